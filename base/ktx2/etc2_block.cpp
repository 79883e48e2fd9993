#include "base/ktx2/etc2_block.h"

#include <algorithm>

namespace tessera::ktx2 {
namespace {

std::uint64_t big_endian_word(std::span<const std::uint8_t, 8> bytes) {
  std::uint64_t word = 0;
  for (const std::uint8_t byte : bytes) word = (word << 8) | byte;
  return word;
}

EtcBytes bytes_of_word(std::uint64_t word) {
  EtcBytes bytes{};
  for (unsigned i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(word >> (56 - 8 * i));
  return bytes;
}

int field(std::uint64_t word, unsigned low, unsigned count) {
  return static_cast<int>((word >> low) & ((1u << count) - 1));
}

std::uint64_t at_bit(int value, unsigned low) { return static_cast<std::uint64_t>(value) << low; }

int signed3(int value) { return value >= 4 ? value - 8 : value; }

Rgb widened(const Rgb& color, int bits) {
  return {widen_bits(color[0], bits), widen_bits(color[1], bits), widen_bits(color[2], bits)};
}

Rgb moved(const Rgb& color, int by) {
  return {std::clamp(color[0] + by, 0, 255), std::clamp(color[1] + by, 0, 255), std::clamp(color[2] + by, 0, 255)};
}

unsigned column_order(unsigned texel) { return texel % 4 * 4 + texel / 4; }

// Two bits a texel: the high ones in bits 31 to 16, the low ones in 15 to 0.
std::uint64_t pack_indices(const TexelIndices& indices) {
  std::uint64_t word = 0;
  for (unsigned texel = 0; texel < 16; ++texel) {
    word |= at_bit(indices[texel] >> 1, 16 + column_order(texel));
    word |= at_bit(indices[texel] & 1, column_order(texel));
  }
  return word;
}

TexelIndices unpack_indices(std::uint64_t word) {
  TexelIndices indices{};
  for (unsigned texel = 0; texel < 16; ++texel)
    indices[texel] =
        static_cast<std::uint8_t>(2 * field(word, 16 + column_order(texel), 1) + field(word, column_order(texel), 1));
  return indices;
}

void store(const Rgb& color, std::array<std::uint8_t, 4>& texel) {
  for (std::size_t c = 0; c < 3; ++c) texel[c] = static_cast<std::uint8_t>(color[c]);
}

int etc1_step(int table, unsigned index) {
  const int step = kEtc1Modifiers[static_cast<std::size_t>(table)][index & 1];
  return index < 2 ? step : -step;
}

// The channel fields at bits 59, 51 and 43: 5 bits of base, 3 bits below them of signed difference.
constexpr std::array<unsigned, 3> kBaseAt = {59, 51, 43};

// Which channel's sum leaves 0 to 31 first: 0 to 2, which chooses T, H and planar; 3 where none does.
unsigned overflowing_channel(std::uint64_t word) {
  for (unsigned c = 0; c < 3; ++c) {
    const int sum = field(word, kBaseAt[c], 5) + signed3(field(word, kBaseAt[c] - 3, 3));
    if (sum < 0 || sum > 31) return c;
  }
  return 3;
}

void decode_halves(std::uint64_t word, TexelBlock& texels) {
  const bool differential = field(word, 33, 1) != 0, flip = field(word, 32, 1) != 0;
  std::array<Rgb, 2> base{};
  for (std::size_t c = 0; c < 3; ++c) {
    if (differential) {
      const int first = field(word, kBaseAt[c], 5);
      base[0][c] = widen_bits(first, 5);
      base[1][c] = widen_bits(first + signed3(field(word, kBaseAt[c] - 3, 3)), 5);
    } else {
      base[0][c] = widen_bits(field(word, kBaseAt[c] + 1, 4), 4);
      base[1][c] = widen_bits(field(word, kBaseAt[c] - 3, 4), 4);
    }
  }
  const std::array<int, 2> table = {field(word, 37, 3), field(word, 34, 3)};
  const TexelIndices indices = unpack_indices(word);
  for (unsigned texel = 0; texel < 16; ++texel) {
    const unsigned half = etc_half(flip, texel);
    store(moved(base[half], etc1_step(table[half], indices[texel])), texels[texel]);
  }
}

void decode_painted(const std::array<Rgb, 4>& colors, std::uint64_t word, TexelBlock& texels) {
  const TexelIndices indices = unpack_indices(word);
  for (unsigned texel = 0; texel < 16; ++texel) store(colors[indices[texel]], texels[texel]);
}

EtcPaint unpack_t(std::uint64_t word) {
  EtcPaint paint;
  paint.color[0] = {4 * field(word, 59, 2) + field(word, 56, 2), field(word, 52, 4), field(word, 48, 4)};
  paint.color[1] = {field(word, 44, 4), field(word, 40, 4), field(word, 36, 4)};
  paint.distance = 2 * field(word, 34, 2) + field(word, 32, 1);
  return paint;
}

int packed_color(const Rgb& color) { return (color[0] << 8) | (color[1] << 4) | color[2]; }

EtcPaint unpack_h(std::uint64_t word) {
  EtcPaint paint;
  paint.color[0] = {field(word, 59, 4), 2 * field(word, 56, 3) + field(word, 52, 1),
                    8 * field(word, 51, 1) + field(word, 47, 3)};
  paint.color[1] = {field(word, 43, 4), field(word, 39, 4), field(word, 35, 4)};
  paint.distance = 4 * field(word, 34, 1) + 2 * field(word, 32, 1) +
                   (packed_color(paint.color[0]) >= packed_color(paint.color[1]) ? 1 : 0);
  return paint;
}

EtcPlane unpack_plane(std::uint64_t word) {
  EtcPlane plane;
  plane.origin = {field(word, 57, 6), 64 * field(word, 56, 1) + field(word, 49, 6),
                  32 * field(word, 48, 1) + 8 * field(word, 43, 2) + field(word, 39, 3)};
  plane.horizontal = {2 * field(word, 34, 5) + field(word, 32, 1), field(word, 25, 7), field(word, 19, 6)};
  plane.vertical = {field(word, 13, 6), field(word, 6, 7), field(word, 0, 6)};
  return plane;
}

// The bits that a mode leaves free make channel c's sum overflow, for T's red, H's green and planar's blue ...
std::uint64_t overflow(std::uint64_t word, unsigned c) {
  const int low = field(word, kBaseAt[c], 2) + field(word, kBaseAt[c] - 3, 2);
  return low >= 4 ? at_bit(7, kBaseAt[c] + 2) : at_bit(1, kBaseAt[c] - 1);
}

// ... and keep it from that before: the top bit of the base where the difference alone would get below zero.
std::uint64_t no_overflow(std::uint64_t word, unsigned c) {
  return field(word, kBaseAt[c], 4) + signed3(field(word, kBaseAt[c] - 3, 3)) < 0 ? at_bit(1, kBaseAt[c] + 4) : 0;
}

}  // namespace

std::array<Rgb, 4> etc2_t_colors(const EtcPaint& paint) {
  const Rgb first = widened(paint.color[0], 4), second = widened(paint.color[1], 4);
  const int distance = kEtc2Distances[static_cast<std::size_t>(paint.distance)];
  return {first, moved(second, distance), second, moved(second, -distance)};
}

std::array<Rgb, 4> etc2_h_colors(const EtcPaint& paint) {
  const Rgb first = widened(paint.color[0], 4), second = widened(paint.color[1], 4);
  const int distance = kEtc2Distances[static_cast<std::size_t>(paint.distance)];
  return {moved(first, distance), moved(first, -distance), moved(second, distance), moved(second, -distance)};
}

int etc2_plane_value(const EtcPlane& plane, std::size_t channel, int x, int y) {
  const int bits = channel == 1 ? 7 : 6, origin = widen_bits(plane.origin[channel], bits);
  const int slopes = x * (widen_bits(plane.horizontal[channel], bits) - origin) +
                     y * (widen_bits(plane.vertical[channel], bits) - origin);
  return std::clamp((slopes + 4 * origin + 2) >> 2, 0, 255);
}

EtcBytes pack_etc1(const EtcHalves& halves) {
  std::uint64_t word = pack_indices(halves.indices) | at_bit(halves.table[0], 37) | at_bit(halves.table[1], 34) |
                       at_bit(halves.differential ? 1 : 0, 33) | at_bit(halves.flip ? 1 : 0, 32);
  for (std::size_t c = 0; c < 3; ++c) {
    const int first = halves.base[0][c], second = halves.base[1][c];
    if (halves.differential)
      word |= at_bit(first, kBaseAt[c]) | at_bit((second - first) & 7, kBaseAt[c] - 3);
    else
      word |= at_bit(first, kBaseAt[c] + 1) | at_bit(second, kBaseAt[c] - 3);
  }
  return bytes_of_word(word);
}

EtcBytes pack_etc2_t(const EtcPaint& paint) {
  const auto& [first, second] = paint.color;
  std::uint64_t word = pack_indices(paint.indices) | at_bit(first[0] >> 2, 59) | at_bit(first[0] & 3, 56) |
                       at_bit(first[1], 52) | at_bit(first[2], 48) | at_bit(second[0], 44) | at_bit(second[1], 40) |
                       at_bit(second[2], 36) | at_bit(paint.distance >> 1, 34) | at_bit(1, 33) |
                       at_bit(paint.distance & 1, 32);
  return bytes_of_word(word | overflow(word, 0));
}

EtcBytes pack_etc2_h(EtcPaint paint) {
  // The distance's low bit is whether the first colour is the greater one or equal. Equal colours have an odd distance
  // only; the caller sees to that.
  if ((packed_color(paint.color[0]) >= packed_color(paint.color[1])) != ((paint.distance & 1) != 0)) {
    std::swap(paint.color[0], paint.color[1]);
    for (std::uint8_t& index : paint.indices) index ^= 2;
  }
  const auto& [first, second] = paint.color;
  std::uint64_t word = pack_indices(paint.indices) | at_bit(first[0], 59) | at_bit(first[1] >> 1, 56) |
                       at_bit(first[1] & 1, 52) | at_bit(first[2] >> 3, 51) | at_bit(first[2] & 7, 47) |
                       at_bit(second[0], 43) | at_bit(second[1], 39) | at_bit(second[2], 35) |
                       at_bit(paint.distance >> 2, 34) | at_bit(1, 33) | at_bit((paint.distance >> 1) & 1, 32);
  return bytes_of_word(word | no_overflow(word, 0) | overflow(word, 1));
}

EtcBytes pack_etc2_plane(const EtcPlane& plane) {
  const auto& [o, h, v] = plane;
  std::uint64_t word = at_bit(o[0], 57) | at_bit(o[1] >> 6, 56) | at_bit(o[1] & 63, 49) | at_bit(o[2] >> 5, 48) |
                       at_bit((o[2] >> 3) & 3, 43) | at_bit(o[2] & 7, 39) | at_bit(h[0] >> 1, 34) | at_bit(1, 33) |
                       at_bit(h[0] & 1, 32) | at_bit(h[1], 25) | at_bit(h[2], 19) | at_bit(v[0], 13) | at_bit(v[1], 6) |
                       at_bit(v[2], 0);
  return bytes_of_word(word | no_overflow(word, 0) | no_overflow(word, 1) | overflow(word, 2));
}

int eac_value(const EacValues& block, unsigned index) {
  return std::clamp(block.base + block.multiplier * kEacModifiers[static_cast<std::size_t>(block.table)][index], 0,
                    255);
}

EtcBytes pack_eac(const EacValues& block) {
  std::uint64_t word = at_bit(block.base, 56) | at_bit(block.multiplier, 52) | at_bit(block.table, 48);
  for (unsigned texel = 0; texel < 16; ++texel) word |= at_bit(block.indices[texel], 45 - 3 * column_order(texel));
  return bytes_of_word(word);
}

void decode_etc2_rgb(std::span<const std::uint8_t, 8> bytes, TexelBlock& texels) {
  const std::uint64_t word = big_endian_word(bytes);
  switch (field(word, 33, 1) != 0 ? overflowing_channel(word) : 3) {
    case 0:
      return decode_painted(etc2_t_colors(unpack_t(word)), word, texels);
    case 1:
      return decode_painted(etc2_h_colors(unpack_h(word)), word, texels);
    case 2: {
      const EtcPlane plane = unpack_plane(word);
      for (unsigned texel = 0; texel < 16; ++texel)
        for (std::size_t c = 0; c < 3; ++c)
          texels[texel][c] = static_cast<std::uint8_t>(
              etc2_plane_value(plane, c, static_cast<int>(texel % 4), static_cast<int>(texel / 4)));
      return;
    }
    default:
      return decode_halves(word, texels);
  }
}

void decode_eac_alpha(std::span<const std::uint8_t, 8> bytes, TexelBlock& texels) {
  const std::uint64_t word = big_endian_word(bytes);
  const EacValues block{field(word, 56, 8), field(word, 52, 4), field(word, 48, 4), {}};
  for (unsigned texel = 0; texel < 16; ++texel)
    texels[texel][3] = static_cast<std::uint8_t>(
        eac_value(block, static_cast<unsigned>(field(word, 45 - 3 * column_order(texel), 3))));
}

}  // namespace tessera::ktx2
