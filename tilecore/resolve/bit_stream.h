#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera::tilecore {

// Bits of a stream in memory, the lowest of each byte first.
class BitWriter {
 public:
  // `bytes` must be zero, and at least as many as will be written.
  explicit BitWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  // Writes the lowest `bits` bits, 0 to 32.
  void write(std::uint32_t value, std::size_t bits) {
    std::uint64_t left = value & ((std::uint64_t{1} << bits) - 1);
    while (bits > 0) {
      const std::size_t at = at_ % 8, n = std::min(bits, 8 - at);
      bytes_[at_ / 8] = static_cast<std::uint8_t>(bytes_[at_ / 8] | (left << at & 0xff));
      left >>= n, at_ += n, bits -= n;
    }
  }
  std::size_t bits() const { return at_; }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  // Reads 0 to 32 bits.
  std::uint32_t read(std::size_t bits) {
    std::uint32_t value = 0;
    for (std::size_t b = 0; b < bits; ++b, ++at_) value |= (bytes_[at_ / 8] >> (at_ % 8) & 1u) << b;
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace tessera::tilecore
