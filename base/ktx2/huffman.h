#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tessera::ktx2 {

// Bits of a byte string, from the least significant bit of each byte up. Reading past the end gives zeros and sets
// overrun(), so callers decode on and check once.
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

  // Whether more bits were read than the string has.
  bool overrun() const { return overrun_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint64_t window_ = 0;  // bits that were fetched and not yet read
  unsigned held_ = 0;
  bool overrun_ = false;
};

// The lengths of a code are themselves packed with a code of 21 symbols: 0 to 16 are lengths, the others repeat. This
// is the order in which the lengths of that second code are stored, so that trailing zeros can be left out.
inline constexpr std::array<std::uint8_t, 21> kHuffmanLengthOrder = {17, 18, 19, 20, 0,  8, 7,  9, 6,  10, 5,
                                                                     11, 4,  12, 3,  13, 2, 14, 1, 15, 16};

// A canonical Huffman code of at most 16 bits a symbol, as RFC 1951 (3.2.2) numbers codes: shorter ones first, symbols
// of one length in rising order; the first bit of a code is the first in the stream.
//
// Invariants (cited by the tests):
//   HU1  A set of lengths is accepted where the code is complete: every bit string decodes. The only incomplete codes
//        that are accepted have no symbol or a single one.
class HuffmanCode {
 public:
  static constexpr std::uint32_t kMaxSymbols = 16383;
  static constexpr unsigned kMaxLength = 16;

  // Takes the lengths in bits by symbol, 0 where a symbol has no code. Returns false where they form no code (HU1).
  [[nodiscard]] bool build(const std::vector<std::uint8_t>& lengths);

  // Reads a code's lengths and builds it (KTX 2.0, appendix BasisLZ/ETC1S, "Compressed Huffman Tables"). Returns false
  // with `fault` set where the lengths form no code.
  [[nodiscard]] bool read(BitReader& reader, std::string& fault);

  // Returns the next symbol, or kNone where the bits match no code, which cannot happen with a complete code.
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::uint32_t decode(BitReader& reader) const;

 private:
  std::array<std::uint32_t, kMaxLength + 1> count_{};  // number of codes by length
  std::vector<std::uint16_t> symbols_;                 // in the order of their codes
};

}  // namespace tessera::ktx2
