#include "base/ktx2/astc_block.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace tessera::ktx2 {
namespace {

// The kinds of UASTC blocks ("UASTC LDR 4x4 Texture Specification").
//
// A mode's number is a prefix code in the low bits; hints for transcoders follow up to bit `start`, where the pattern
// or the second plane's channel is and behind it the endpoints. Digits of endpoints come first, packed as plain
// numbers, then their bits; weights follow, the first one of each subset without its high bit, which is 0.
struct UastcMode {
  unsigned code, code_bits, start;
  int components, subsets, planes, weight_levels, endpoint_levels;
};
constexpr std::array<UastcMode, 19> kModes = {{{1, 4, 19, 3, 1, 1, 16, 192},
                                               {53, 6, 21, 3, 1, 1, 4, 256},
                                               {29, 5, 20, 3, 2, 1, 8, 16},
                                               {3, 5, 20, 3, 3, 1, 4, 12},
                                               {19, 5, 20, 3, 2, 1, 4, 40},
                                               {11, 5, 20, 3, 1, 1, 8, 256},
                                               {27, 5, 20, 3, 1, 2, 4, 160},
                                               {7, 5, 20, 3, 2, 1, 4, 40},
                                               {23, 5, 5, 4, 1, 1, 0, 0},  // a solid colour
                                               {15, 5, 28, 4, 2, 1, 4, 16},
                                               {2, 3, 20, 4, 1, 1, 16, 48},
                                               {0, 2, 19, 4, 1, 2, 4, 48},
                                               {6, 3, 20, 4, 1, 1, 8, 192},
                                               {31, 5, 28, 4, 1, 2, 2, 256},
                                               {13, 5, 28, 4, 1, 1, 4, 256},
                                               {5, 7, 30, 2, 1, 1, 16, 256},
                                               {21, 6, 29, 2, 2, 1, 4, 256},
                                               {37, 6, 29, 2, 1, 2, 4, 256},
                                               {9, 4, 19, 3, 1, 1, 32, 32}}};
constexpr std::size_t kSolidMode = 8, kOtherPatternsMode = 7, kReservedMode = kModes.size();

// The modes by the low 7 bits of a block. One code is left over.
constexpr std::array<std::uint8_t, 128> modes_by_bits() {
  std::array<std::uint8_t, 128> modes{};
  for (unsigned bits = 0; bits < modes.size(); ++bits) {
    modes[bits] = kReservedMode;
    for (std::size_t mode = 0; mode < kModes.size(); ++mode)
      if ((bits & ((1u << kModes[mode].code_bits) - 1)) == kModes[mode].code)
        modes[bits] = static_cast<std::uint8_t>(mode);
  }
  return modes;
}
constexpr std::array<std::uint8_t, 128> kModeByBits = modes_by_bits();

// Seeds of the patterns: two subsets, which BC7 has as well; two merged subsets of BC7's patterns of three, for mode 7;
// three subsets.
constexpr std::array<std::uint16_t, 30> kTwoSubsets = {28,  20,  16,  29,  91,  9,   107, 72,  149, 204,
                                                       50,  114, 496, 17,  78,  39,  252, 828, 43,  156,
                                                       116, 210, 476, 273, 684, 359, 246, 195, 694, 524};
constexpr std::array<std::uint16_t, 19> kTwoMergedSubsets = {36,  48,  61,  137, 161, 183, 226, 281, 302, 307,
                                                             479, 495, 593, 594, 605, 799, 812, 988, 993};
constexpr std::array<std::uint16_t, 11> kThreeSubsets = {260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254};

std::span<const std::uint16_t> seeds_of(std::size_t mode) {
  if (mode == kOtherPatternsMode) return kTwoMergedSubsets;
  if (kModes[mode].subsets == 3) return kThreeSubsets;
  return kTwoSubsets;
}

// Reads on from a bit of a block.
class BlockBits {
 public:
  BlockBits(const AstcBytes& bytes, unsigned at) : bytes_(bytes), at_(at) {}
  std::uint32_t next(unsigned count) { return get_bits(bytes_, (at_ += count) - count, count); }

 private:
  const AstcBytes& bytes_;
  unsigned at_;
};

// Digits of base 3 or 5: up to five in 8 bits, up to three in 7 bits, fewer of them in fewer bits.
void read_digits(BlockBits& bits, AstcRange range, std::span<std::uint8_t> values) {
  static constexpr std::array<unsigned, 6> kTritBits = {0, 2, 4, 5, 7, 8};
  static constexpr std::array<unsigned, 4> kQuintBits = {0, 3, 5, 7};
  const std::size_t group = range.base == 3 ? 5 : 3;
  for (std::size_t first = 0; first < values.size(); first += group) {
    const std::size_t count = std::min(group, values.size() - first);
    std::uint32_t packed = bits.next(range.base == 3 ? kTritBits[count] : kQuintBits[count]);
    for (std::uint8_t& value : values.subspan(first, count)) {
      value = static_cast<std::uint8_t>(packed % static_cast<std::uint32_t>(range.base) << range.bits);
      packed /= static_cast<std::uint32_t>(range.base);
    }
  }
}

}  // namespace

bool read_uastc(const AstcBytes& bytes, AstcBlock& block) {
  const std::size_t number = kModeByBits[bytes[0] & 127u];
  block = AstcBlock{};
  if (number == kReservedMode) return false;
  const UastcMode& mode = kModes[number];
  BlockBits bits(bytes, mode.start);
  if (number == kSolidMode) {
    block.solid = true;
    for (std::uint8_t& channel : block.color) channel = static_cast<std::uint8_t>(bits.next(8));
    return true;
  }
  block.components = mode.components;
  block.subsets = mode.subsets;
  block.planes = mode.planes;
  block.endpoint_range = astc_range(mode.endpoint_levels);
  block.weight_range = astc_range(mode.weight_levels);
  block.plane_channel = 3;
  if (mode.planes == 2 && mode.components > 2) block.plane_channel = bits.next(2);
  if (mode.subsets > 1) {
    const std::span<const std::uint16_t> seeds = seeds_of(number);
    const std::uint32_t pattern = bits.next(mode.subsets == 3 ? 4 : 5);
    if (pattern >= seeds.size()) return false;
    block.seed = seeds[pattern];
  }
  const std::span<std::uint8_t> endpoints(block.endpoints.data(), block.endpoint_count());
  if (block.endpoint_range.base > 1) read_digits(bits, block.endpoint_range, endpoints);
  for (std::uint8_t& value : endpoints)
    value = static_cast<std::uint8_t>(value | bits.next(static_cast<unsigned>(block.endpoint_range.bits)));

  const std::array<std::uint8_t, 16> pattern = astc_partition(block.seed, block.subsets);
  const auto planes = static_cast<std::size_t>(block.planes);
  unsigned seen = 0;  // subsets, a bit each
  for (std::size_t texel = 0; texel < 16; ++texel) {
    const bool first = ((seen >> pattern[texel]) & 1u) == 0;
    seen |= 1u << pattern[texel];
    for (std::size_t plane = 0; plane < planes; ++plane)
      block.weights[planes * texel + plane] =
          static_cast<std::uint8_t>(bits.next(static_cast<unsigned>(block.weight_range.bits) - (first ? 1 : 0)));
  }
  return true;
}

}  // namespace tessera::ktx2
