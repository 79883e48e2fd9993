#include "base/ktx2/astc_block.h"

#include <algorithm>
#include <optional>

namespace tessera::ktx2 {
namespace {

// Red, green, blue, alpha of the low and the high endpoint, 8 bits.
using Ends = std::array<std::array<int, 4>, 2>;

constexpr unsigned kModeBits = 11, kPartBits = 2, kSeedBits = 10;
// Where the endpoints' mode and the endpoints begin, with one subset and with several.
constexpr unsigned kOneSubsetMode = kModeBits + kPartBits, kManySubsetsMode = kOneSubsetMode + kSeedBits;
constexpr unsigned kOneSubsetEnds = kOneSubsetMode + 4, kManySubsetsEnds = kManySubsetsMode + 6;

// Two-dimensional block with a solid colour of 16 bits a channel: mode, reserved bits and coordinates that are all
// ones.
constexpr std::uint32_t kVoidExtent = 0x1FC;
constexpr unsigned kSolidColorAt = 64;

// Endpoint modes of direct colours: luminance and alpha, RGB, RGBA.
constexpr std::uint32_t endpoint_mode(int components) { return static_cast<std::uint32_t>(4 * components - 4); }

// The block mode of a 4x4 grid: three bits of the weights' range, of which the low one is bit 4, and bits for ranges of
// ten and more levels and for the second plane.
std::uint32_t block_mode(AstcRange weights, int planes) {
  std::uint32_t number = 2;
  while (kAstcRanges[number - 2].levels() != weights.levels()) ++number;
  const std::uint32_t high = number >= 8 ? 1 : 0;
  if (high != 0) number -= 6;
  return 0x40u | (number >> 1) | ((number & 1u) << 4) | (high << 9) | (planes == 2 ? 1u << 10 : 0u);
}

struct Grid {
  AstcRange weights;
  int planes;
};
std::optional<Grid> grid_of(std::uint32_t mode) {
  for (std::size_t range = 0; kAstcRanges[range].levels() <= 32; ++range)
    for (const int planes : {1, 2})
      if (block_mode(kAstcRanges[range], planes) == mode) return Grid{kAstcRanges[range], planes};
  return std::nullopt;
}

int blended(int low, int high, int weight, bool srgb) {
  const int l = (low << 8) | (srgb ? 0x80 : low), h = (high << 8) | (srgb ? 0x80 : high);
  return (l * (64 - weight) + h * weight + 32) >> 14;
}

void blend_texels(const AstcBlock& block, const std::array<Ends, 3>& ends, bool srgb, TexelBlock& texels) {
  const std::array<std::uint8_t, 16> pattern = astc_partition(block.seed, block.subsets);
  const auto planes = static_cast<std::size_t>(block.planes);
  for (std::size_t texel = 0; texel < 16; ++texel) {
    const Ends& pair = ends[pattern[texel]];
    const int first = astc_weight(block.weight_range, block.weights[planes * texel]);
    const int second = astc_weight(block.weight_range, block.weights[planes * texel + planes - 1]);
    for (std::size_t c = 0; c < 4; ++c)
      texels[texel][c] = static_cast<std::uint8_t>(
          blended(pair[0][c], pair[1][c], c == block.plane_channel ? second : first, srgb && c < 3));
  }
}

// Endpoints of one subset from their values, as they stand.
Ends direct_ends(const AstcBlock& block, std::size_t subset) {
  const auto components = static_cast<std::size_t>(block.components);
  Ends ends{};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto number = [&](std::size_t component) {
      return astc_endpoint(block.endpoint_range, block.endpoints[2 * (components * subset + component) + side]);
    };
    for (std::size_t c = 0; c < 3; ++c) ends[side][c] = number(components == 2 ? 0 : c);
    ends[side][3] = components == 3 ? 255 : number(components - 1);
  }
  return ends;
}

bool is_contracted(const Ends& ends) {
  return ends[1][0] + ends[1][1] + ends[1][2] < ends[0][0] + ends[0][1] + ends[0][2];
}

// Endpoints in falling order mean "blue contraction": they are exchanged, and red and green are halfway to blue.
Ends expanded(const Ends& ends) {
  Ends out = {ends[1], ends[0]};
  for (auto& end : out)
    for (std::size_t c = 0; c < 2; ++c) end[c] = (end[c] + end[2]) >> 1;
  return out;
}

// The same colours with rising endpoints in every subset: falling ones exchanged, their texels' weights mirrored.
AstcBlock rising(AstcBlock block) {
  if (block.components == 2) return block;
  const std::array<std::uint8_t, 16> pattern = astc_partition(block.seed, block.subsets);
  const auto values = static_cast<std::size_t>(2 * block.components), planes = static_cast<std::size_t>(block.planes);
  for (std::size_t subset = 0; subset < static_cast<std::size_t>(block.subsets); ++subset) {
    if (!is_contracted(direct_ends(block, subset))) continue;
    for (std::size_t i = 0; i < values; i += 2)
      std::swap(block.endpoints[values * subset + i], block.endpoints[values * subset + i + 1]);
    for (std::size_t i = 0; i < block.weight_count(); ++i)
      if (pattern[i / planes] == subset) {
        // Values with a digit and bits pair up by their low bit; values of bits or of a digit alone pair up from both
        // ends.
        std::uint8_t& weight = block.weights[i];
        const int last = block.weight_range.levels() - 1;
        if (block.weight_range.base == 1 || block.weight_range.bits == 0)
          weight = static_cast<std::uint8_t>(last - weight);
        else
          weight ^= 1;
      }
  }
  return block;
}

}  // namespace

void astc_texels(const AstcBlock& block, bool srgb, TexelBlock& texels) {
  if (block.solid) return texels.fill(block.color);
  std::array<Ends, 3> ends{};
  for (std::size_t subset = 0; subset < static_cast<std::size_t>(block.subsets); ++subset)
    ends[subset] = direct_ends(block, subset);
  blend_texels(block, ends, srgb, texels);
}

AstcBytes pack_astc(const AstcBlock& wanted) {
  AstcBytes bytes{};
  if (wanted.solid) {
    bytes.fill(0xFF);
    bytes[0] = kVoidExtent & 0xFF;
    bytes[1] = 0xFC | (kVoidExtent >> 8);
    for (std::size_t i = 0; i < 8; ++i) bytes[8 + i] = wanted.color[i / 2];
    return bytes;
  }
  const AstcBlock block = rising(wanted);
  const std::span<const std::uint8_t> weights(block.weights.data(), block.weight_count());
  put_sequence(bytes, 0, block.weight_range, weights);
  bytes = reversed_bits(bytes);
  put_bits(bytes, 0, kModeBits, block_mode(block.weight_range, block.planes));
  put_bits(bytes, kModeBits, kPartBits, static_cast<std::uint32_t>(block.subsets - 1));
  if (block.subsets == 1) {
    put_bits(bytes, kOneSubsetMode, 4, endpoint_mode(block.components));
  } else {
    put_bits(bytes, kOneSubsetMode, kSeedBits, block.seed);
    put_bits(bytes, kManySubsetsMode, 6, endpoint_mode(block.components) << 2);
  }
  put_sequence(bytes, block.subsets == 1 ? kOneSubsetEnds : kManySubsetsEnds, block.endpoint_range,
               {block.endpoints.data(), block.endpoint_count()});
  if (block.planes == 2)
    put_bits(bytes, 126 - block.weight_range.sequence_bits(static_cast<unsigned>(weights.size())), 2,
             block.plane_channel);
  return bytes;
}

bool decode_astc(const AstcBytes& bytes, bool srgb, TexelBlock& texels) {
  const std::uint32_t mode = get_bits(bytes, 0, kModeBits);
  if ((mode & 0x1FF) == kVoidExtent) {
    if (mode != 0x5FC) return false;  // of HDR, or reserved
    AstcBlock block;
    for (unsigned c = 0; c < 4; ++c)
      block.color[c] = static_cast<std::uint8_t>(get_bits(bytes, kSolidColorAt + 16 * c + 8, 8));
    texels.fill(block.color);
    return true;
  }
  const std::optional<Grid> grid = grid_of(mode);
  if (!grid) return false;
  AstcBlock block;
  block.weight_range = grid->weights;
  block.planes = grid->planes;
  block.subsets = static_cast<int>(get_bits(bytes, kModeBits, kPartBits)) + 1;
  if (block.subsets > 3) return false;
  std::uint32_t ends_mode = get_bits(bytes, kOneSubsetMode, 4);
  if (block.subsets > 1) {
    block.seed = get_bits(bytes, kOneSubsetMode, kSeedBits);
    ends_mode = get_bits(bytes, kManySubsetsMode, 6);
    if (ends_mode % 4 != 0) return false;
    ends_mode /= 4;
  }
  if (ends_mode != 4 && ends_mode != 8 && ends_mode != 12) return false;
  block.components = static_cast<int>(ends_mode / 4 + 1);

  const unsigned first = block.subsets == 1 ? kOneSubsetEnds : kManySubsetsEnds;
  unsigned last = 128 - block.weight_range.sequence_bits(static_cast<unsigned>(block.weight_count()));
  block.plane_channel = 4;  // none
  if (block.planes == 2) block.plane_channel = get_bits(bytes, last -= 2, 2);
  // Endpoints have the finest range that the bits between have room for.
  std::size_t range = kAstcRanges.size();
  const auto count = static_cast<unsigned>(block.endpoint_count());
  if (count > block.endpoints.size() || last < first) return false;
  while (range > 0 && kAstcRanges[range - 1].sequence_bits(count) > last - first) --range;
  if (range == 0 || kAstcRanges[range - 1].levels() < 6) return false;
  block.endpoint_range = kAstcRanges[range - 1];
  get_sequence(bytes, first, block.endpoint_range, {block.endpoints.data(), block.endpoint_count()});
  get_sequence(reversed_bits(bytes), 0, block.weight_range, {block.weights.data(), block.weight_count()});

  std::array<Ends, 3> ends{};
  for (std::size_t subset = 0; subset < static_cast<std::size_t>(block.subsets); ++subset) {
    ends[subset] = direct_ends(block, subset);
    if (block.components > 2 && is_contracted(ends[subset])) ends[subset] = expanded(ends[subset]);
  }
  blend_texels(block, ends, srgb, texels);
  return true;
}

}  // namespace tessera::ktx2
