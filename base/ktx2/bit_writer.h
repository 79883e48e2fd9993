#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace tessera::ktx2 {

// The lowest `bytes` bytes of a number, little endian.
inline void put_number(std::string& out, std::uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
}

// The counterpart of BitReader: bits into bytes, from the least significant bit of each byte up.
class BitWriter {
 public:
  // The lowest `count` bits of `value`, 0 to 32, the least significant first.
  void bits(std::uint32_t value, unsigned count) {
    window_ |= (value & ((std::uint64_t{1} << count) - 1)) << held_;
    held_ += count;
    for (; held_ >= 8; held_ -= 8, window_ >>= 8) bytes_.push_back(static_cast<char>(window_ & 0xFF));
  }

  // All bytes so far, the last one filled up with zeros.
  std::string take() {
    if (held_ > 0) bytes_.push_back(static_cast<char>(window_ & 0xFF));
    window_ = held_ = 0;
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint64_t window_ = 0;
  unsigned held_ = 0;
};

}  // namespace tessera::ktx2
