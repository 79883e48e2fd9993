#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/ktx2/texel_block.h"

// Blocks of ETC1, ETC2 and EAC (Khronos Data Format 1.3, chapters 21 and 22). Words are big-endian in memory; texels
// are numbered column by column inside the words, and row by row everywhere else in this code.
namespace tessera::ktx2 {

// The two steps, small and large, of each table; a texel's index chooses +small, +large, -small, -large.
inline constexpr std::array<std::array<int, 2>, 8> kEtc1Modifiers = {
    {{2, 8}, {5, 17}, {9, 29}, {13, 42}, {18, 60}, {24, 80}, {33, 106}, {47, 183}}};

// Distances of the modes T and H.
inline constexpr std::array<int, 8> kEtc2Distances = {3, 6, 11, 16, 23, 32, 41, 64};

// Table of steps by index: step * multiplier is added to the base value of an EAC block.
inline constexpr std::array<std::array<int, 8>, 16> kEacModifiers = {{{-3, -6, -9, -15, 2, 5, 8, 14},
                                                                      {-3, -7, -10, -13, 2, 6, 9, 12},
                                                                      {-2, -5, -8, -13, 1, 4, 7, 12},
                                                                      {-2, -4, -6, -13, 1, 3, 5, 12},
                                                                      {-3, -6, -8, -12, 2, 5, 7, 11},
                                                                      {-3, -7, -9, -11, 2, 6, 8, 10},
                                                                      {-4, -7, -8, -11, 3, 6, 7, 10},
                                                                      {-3, -5, -8, -11, 2, 4, 7, 10},
                                                                      {-2, -6, -8, -10, 1, 5, 7, 9},
                                                                      {-2, -5, -8, -10, 1, 4, 7, 9},
                                                                      {-2, -4, -8, -10, 1, 3, 7, 9},
                                                                      {-2, -5, -7, -10, 1, 4, 6, 9},
                                                                      {-3, -4, -7, -10, 2, 3, 6, 9},
                                                                      {-1, -2, -3, -10, 0, 1, 2, 9},
                                                                      {-4, -6, -8, -9, 3, 5, 7, 8},
                                                                      {-3, -5, -7, -9, 2, 4, 6, 8}}};

using Rgb = std::array<int, 3>;
// A texel's index in row order.
using TexelIndices = std::array<std::uint8_t, 16>;

// Two halves of 2x4 texels, or 4x2 where `flip`, with a base colour and a table each. Base colours have 4 bits a
// channel or, where `differential`, 5 bits and differ by -4 to 3.
struct EtcHalves {
  bool differential = false, flip = false;
  std::array<Rgb, 2> base{};
  std::array<int, 2> table{};
  TexelIndices indices{};  // indices into the row of kEtc1Modifiers
};
// 1 for texels of the second half.
constexpr unsigned etc_half(bool flip, unsigned texel) { return (flip ? texel / 4 : texel % 4) / 2; }

// Two colours of 4 bits a channel and a distance, 0 to 7. Mode T paints with the first colour, and with the second one
// moved by +distance, 0 and -distance. Mode H paints with both colours, each moved by +distance and -distance. H cannot
// encode every combination of colours, as 12-bit numbers, and the distance's low bit; see pack_etc2_h().
struct EtcPaint {
  std::array<Rgb, 2> color{};
  int distance = 0;
  TexelIndices indices{};
};
// The four colours that a T or H block paints with, by index, in 8 bits.
std::array<Rgb, 4> etc2_t_colors(const EtcPaint& paint);
std::array<Rgb, 4> etc2_h_colors(const EtcPaint& paint);

// Colours, 6, 7 and 6 bits a channel, at texel (0, 0) and where (4, 0) and (0, 4) would be.
struct EtcPlane {
  Rgb origin{}, horizontal{}, vertical{};
};
// A channel of a texel, 8 bits.
int etc2_plane_value(const EtcPlane& plane, std::size_t channel, int x, int y);

// The 8 bytes of a block. All fields must be in their ranges.
using EtcBytes = std::array<std::uint8_t, 8>;
EtcBytes pack_etc1(const EtcHalves& halves);
EtcBytes pack_etc2_t(const EtcPaint& paint);
EtcBytes pack_etc2_h(EtcPaint paint);  // exchanges the colours where the distance needs it
EtcBytes pack_etc2_plane(const EtcPlane& plane);

// Base 0 to 255, multiplier 1 to 15 (0 is read as it stands), table 0 to 15, indices 0 to 7.
struct EacValues {
  int base = 0, multiplier = 1, table = 0;
  TexelIndices indices{};
};
int eac_value(const EacValues& block, unsigned index);
EtcBytes pack_eac(const EacValues& block);

// Writes red, green and blue of the texels of any 8 bytes as ETC2, or alpha of any 8 bytes as EAC.
void decode_etc2_rgb(std::span<const std::uint8_t, 8> bytes, TexelBlock& texels);
void decode_eac_alpha(std::span<const std::uint8_t, 8> bytes, TexelBlock& texels);

}  // namespace tessera::ktx2
