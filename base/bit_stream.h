#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/check.h"

namespace tessera {

// Writes bits from the lowest bit of each byte on. The packed formats of the baselines and of encoded geometry use it.
class BitWriter {
 public:
  void put(std::uint32_t value, std::uint32_t bits) {
    for (std::uint32_t b = 0; b < bits; ++b, ++count_) {
      if (count_ % 8 == 0) bytes_.push_back(0);
      bytes_.back() = static_cast<std::uint8_t>(bytes_.back() | ((value >> b & 1u) << (count_ % 8)));
    }
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  std::size_t bit_count() const { return count_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t count_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  // At most 32 bits.
  std::uint32_t get(std::uint32_t bits) {
    TESSERA_CHECK(at_ + bits <= bytes_.size() * 8, "packed data ends within its bytes");
    std::uint32_t value = 0;
    for (std::uint32_t b = 0; b < bits; ++b, ++at_) value |= (bytes_[at_ / 8] >> (at_ % 8) & 1u) << b;
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// A BitReader for unchecked bytes: a read past the end gives zero and sets overrun().
class BoundedBitReader {
 public:
  explicit BoundedBitReader(std::span<const std::uint8_t> bytes) : reader_(bytes), left_(8 * bytes.size()) {}
  // At most 32 bits.
  std::uint32_t get(std::uint32_t bits) {
    if (overrun_ || bits > left_) {
      overrun_ = true;
      return 0;
    }
    left_ -= bits;
    return reader_.get(bits);
  }
  bool overrun() const { return overrun_; }

 private:
  BitReader reader_;
  std::size_t left_;
  bool overrun_ = false;
};

// A number in groups of 7 bits, lowest first; the top bit is set on all bytes but the last.
inline void put_number(std::uint64_t value, std::vector<std::uint8_t>& out) {
  for (; value >= 128; value >>= 7) out.push_back(static_cast<std::uint8_t>(value | 128u));
  out.push_back(static_cast<std::uint8_t>(value));
}
inline std::uint64_t get_number(std::span<const std::uint8_t> bytes, std::size_t& at) {
  std::uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    value |= static_cast<std::uint64_t>(bytes[at] & 127u) << shift;
    if ((bytes[at++] & 128u) == 0) return value;
  }
}

// Four bytes, the lowest first.
inline void put_word(std::uint32_t word, std::vector<std::uint8_t>& out) {
  for (unsigned b = 0; b < 4; ++b) out.push_back(static_cast<std::uint8_t>(word >> (8 * b)));
}

// The number that two's complement of `bits` bits, 1 to 32, stands for.
constexpr std::int32_t sign_extended(std::uint32_t value, std::uint32_t bits) {
  return static_cast<std::int32_t>(value << (32 - bits)) >> (32 - bits);
}

// Signed numbers with small sizes first: 0, -1, 1, -2, ...
constexpr std::uint32_t zigzag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ (value < 0 ? ~0u : 0u);
}
constexpr std::int32_t unzigzag(std::uint32_t code) {
  return static_cast<std::int32_t>((code >> 1) ^ ((code & 1u) != 0 ? ~0u : 0u));
}

}  // namespace tessera
