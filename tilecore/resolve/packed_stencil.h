#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {

// A stencil as a resolve unit would keep it in a constant table (US 2015/0379692: a count, then all weights, then all
// offsets along x, then along y), lowest bit first:
//   4 bits   number of taps - 1: a stencil has at least one tap, and a 7x7 one up to sixteen
//   8 bits   per tap: weight, two's complement
//   3 bits   per tap: dx from the pixel to fill to the tap, two's complement, -3..3
//   3 bits   per tap: dy
// The weights sum to a power of two, 64, 128 or 256: the largest for which all of them fit. A decoder sums the weights
// anyway, so the shift of the result (or of its exponent) follows from the sum and is not stored.
inline constexpr std::size_t kMaxTaps = 16;
inline constexpr std::size_t kCountBits = 4, kWeightBits = 8, kOffsetBits = 3;
constexpr std::size_t packed_stencil_bits(std::size_t taps) {
  return kCountBits + taps * (kWeightBits + 2 * kOffsetBits);
}

struct StencilTap {
  std::int8_t dx = 0, dy = 0;
  std::int16_t weight = 0;  // -128..127
  constexpr bool operator==(const StencilTap&) const = default;
};

struct Stencil {
  std::size_t count = 0;
  std::array<StencilTap, kMaxTaps> taps{};

  constexpr int unit() const {
    int sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += taps[i].weight;
    return sum;
  }
  constexpr bool operator==(const Stencil&) const = default;
};

// Reads `bits` bits from bit `at` on, as two's complement if signed.
constexpr int read_packed(std::span<const std::uint8_t> stream, std::size_t at, std::size_t bits, bool is_signed) {
  int value = 0;
  for (std::size_t b = 0; b < bits; ++b) value |= (stream[(at + b) / 8] >> ((at + b) % 8) & 1) << b;
  return is_signed && (value >> (bits - 1) & 1) ? value - (1 << bits) : value;
}
constexpr void write_packed(std::span<std::uint8_t> stream, std::size_t at, std::size_t bits, int value) {
  for (std::size_t b = 0; b < bits; ++b)
    if (value >> b & 1) stream[(at + b) / 8] = static_cast<std::uint8_t>(stream[(at + b) / 8] | 1u << ((at + b) % 8));
}

constexpr Stencil unpack_stencil(std::span<const std::uint8_t> stream, std::size_t at) {
  Stencil s;
  s.count = static_cast<std::size_t>(read_packed(stream, at, kCountBits, false)) + 1;
  const std::size_t weights = at + kCountBits, xs = weights + kWeightBits * s.count, ys = xs + kOffsetBits * s.count;
  for (std::size_t i = 0; i < s.count; ++i)
    s.taps[i] = {static_cast<std::int8_t>(read_packed(stream, xs + kOffsetBits * i, kOffsetBits, true)),
                 static_cast<std::int8_t>(read_packed(stream, ys + kOffsetBits * i, kOffsetBits, true)),
                 static_cast<std::int16_t>(read_packed(stream, weights + kWeightBits * i, kWeightBits, true))};
  return s;
}

// Writes over bits that must be 0; returns the bit after the last.
constexpr std::size_t pack_stencil(const Stencil& s, std::span<std::uint8_t> stream, std::size_t at) {
  write_packed(stream, at, kCountBits, static_cast<int>(s.count) - 1);
  const std::size_t weights = at + kCountBits, xs = weights + kWeightBits * s.count, ys = xs + kOffsetBits * s.count;
  for (std::size_t i = 0; i < s.count; ++i) {
    write_packed(stream, weights + kWeightBits * i, kWeightBits, s.taps[i].weight);
    write_packed(stream, xs + kOffsetBits * i, kOffsetBits, s.taps[i].dx);
    write_packed(stream, ys + kOffsetBits * i, kOffsetBits, s.taps[i].dy);
  }
  return at + packed_stencil_bits(s.count);
}

// ---- Which stencil a pixel has ----------------------------------------------------------------------------------

// A symmetry of the pixel grid: axes exchanged first, then signs flipped. Stencils that are equal up to a symmetry are
// stored once.
struct GridSymmetry {
  std::uint8_t bits = 0;  // 1: exchange x and y; 2: negate x; 4: negate y

  constexpr StencilTap apply(StencilTap t) const {
    if (bits & 1) t = {t.dy, t.dx, t.weight};
    if (bits & 2) t.dx = static_cast<std::int8_t>(-t.dx);
    if (bits & 4) t.dy = static_cast<std::int8_t>(-t.dy);
    return t;
  }
};

// Sides of the block beyond which no pixel may be used.
enum BorderSide : unsigned { kLeftBorder = 1, kRightBorder = 2, kTopBorder = 4, kBottomBorder = 8 };
inline constexpr unsigned kBorderCases = 16;

// Two patterns are enough: the others are their mirror images (see pattern_of()).
inline constexpr std::array<BlockMask, 2> kTablePatterns = {sparse_square(0, 0), kPairOrder[0]};
// Kernels with weights; kNearest has none.
inline constexpr std::size_t kTableKernels = 4;

// The generator writes one for each kernel, border case, pattern and pixel.
struct StencilIndexEntry {
  std::uint16_t stencil = 0xffff;  // 0xffff: rendered pixel, no stencil that holds, or no table
  GridSymmetry symmetry;           // from the stored stencil to the pixel's
};
inline constexpr std::uint16_t kNoStencil = 0xffff;

// Mirrors of coordinates within a block: bit 0 flips x, bit 1 flips y.
constexpr int mirrored_pixel(int pixel, unsigned mirror) {
  return pixel ^ (mirror & 1 ? 3 : 0) ^ (mirror & 2 ? 12 : 0);
}
constexpr unsigned mirrored_border(unsigned border, unsigned mirror) {
  if (mirror & 1) border = (border & 12u) | (border & 1u) << 1 | (border >> 1 & 1u);
  if (mirror & 2) border = (border & 3u) | (border & 4u) << 1 | (border >> 1 & 4u);
  return border;
}

// The stencil that reconstruct_block() uses, largest weight first; nullopt if it evaluates directly. `pattern`: one of
// kSquareOrder or kPairOrder. `border`: a sum of BorderSide.
std::optional<Stencil> table_stencil(Reconstruction kernel, BlockMask pattern, unsigned border, int pixel);

// The size of the tables in a machine that keeps them: all stencils, and one index entry of 16 bits per kernel, border
// case, table pattern and pixel.
struct StencilTableSize {
  std::size_t stencils, stencil_bits, index_entries;
};
StencilTableSize stencil_table_size();

}  // namespace tessera::tilecore
