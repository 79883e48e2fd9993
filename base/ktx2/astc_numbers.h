#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

// The numbers of ASTC blocks (Khronos Data Format 1.3, sections 23.12 to 23.15 and 23.21): integer sequences,
// unquantized values and partitions.
namespace tessera::ktx2 {

// Values 0 to levels - 1: a digit of base 1, 3 or 5 above some bits.
struct AstcRange {
  int base, bits;

  constexpr int levels() const { return base << bits; }
  // Bits of `count` values together.
  constexpr unsigned sequence_bits(unsigned count) const {
    const unsigned digits = base == 3 ? (8 * count + 4) / 5 : base == 5 ? (7 * count + 2) / 3 : 0;
    return digits + static_cast<unsigned>(bits) * count;
  }
};

// The 21 ranges of the format, by their number in it: 2 levels to 256.
inline constexpr std::array<AstcRange, 21> kAstcRanges = {{{1, 1}, {3, 0}, {1, 2}, {5, 0}, {3, 1}, {1, 3}, {5, 1},
                                                           {3, 2}, {1, 4}, {5, 2}, {3, 3}, {1, 5}, {5, 3}, {3, 4},
                                                           {1, 6}, {5, 4}, {3, 5}, {1, 7}, {5, 5}, {3, 6}, {1, 8}}};

// A range by its number of levels; a constant expression, which fails where there is none.
constexpr AstcRange astc_range(int levels) {
  for (const AstcRange& range : kAstcRanges)
    if (range.levels() == levels) return range;
  throw "no such range";
}

// Unquantized number of a value: 0 to 255 for an endpoint (ranges of 6 levels and more), 0 to 64 for a weight (up to 32
// levels).
int astc_endpoint(AstcRange range, int value);
int astc_weight(AstcRange range, int value);

// The value whose unquantized number is nearest to `wanted`; of two, the one with the smaller number.
int nearest_astc_endpoint(AstcRange range, int wanted);

// 128 bits, the first in the low bit of byte 0.
using AstcBytes = std::array<std::uint8_t, 16>;
std::uint32_t get_bits(const AstcBytes& bytes, unsigned at, unsigned count);        // up to 25 bits
void put_bits(AstcBytes& bytes, unsigned at, unsigned count, std::uint32_t value);  // into zeros
AstcBytes reversed_bits(const AstcBytes& bytes);                                    // bit 127 first

// Integer sequences from bit `at` on, range.sequence_bits(values.size()) long.
void put_sequence(AstcBytes& bytes, unsigned at, AstcRange range, std::span<const std::uint8_t> values);
void get_sequence(const AstcBytes& bytes, unsigned at, AstcRange range, std::span<std::uint8_t> values);

// The subset, below `subsets` (1 to 3), of each texel of a 4x4 block, row by row, by the seed's pattern.
std::array<std::uint8_t, 16> astc_partition(std::uint32_t seed, int subsets);

}  // namespace tessera::ktx2
