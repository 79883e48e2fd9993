#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera::ktx2 {

// Bits of a byte string, from the least significant bit of each byte up. Reading past the end gives zeros and is
// remembered: callers decode on and ask once.
class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  // The next `count` bits, 0 to 32, the first of them the least significant.
  std::uint32_t bits(unsigned count) {
    while (held_ < count) {
      if (at_ < bytes_.size())
        window_ |= static_cast<std::uint64_t>(bytes_[at_++]) << held_;
      else
        overrun_ = true;
      held_ += 8;
    }
    const auto value = static_cast<std::uint32_t>(window_ & ((std::uint64_t{1} << count) - 1));
    window_ >>= count;
    held_ -= count;
    return value;
  }

  // More bits were asked for than there are.
  bool overrun() const { return overrun_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint64_t window_ = 0;  // bits that were fetched and not yet read
  unsigned held_ = 0;
  bool overrun_ = false;
};

}  // namespace tessera::ktx2
