#pragma once

#include <cmath>
#include <cstdint>

#include "base/rect.h"
#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Bit of pixel (x, y) of the frame within its block of 4x4 pixels. Blocks lie on multiples of four pixels of the frame.
constexpr BlockMask block_bit(int x, int y) { return static_cast<BlockMask>(1u << (4 * (y & 3) + (x & 3))); }

// Spreads the bits of a row of four pixels to a byte each, 0 or 1.
constexpr std::uint32_t row_bytes(unsigned bits) {
  return (bits & 1u) | (bits & 2u) << 7 | (bits & 4u) << 14 | (bits & 8u) << 21;
}

// Avoids the population-count instruction, which the oldest x86-64 lacks: there std::popcount is a call.
constexpr std::uint64_t pixel_count(BlockMask pixels) {
  unsigned n = pixels - (pixels >> 1 & 0x5555u);
  n = (n & 0x3333u) + (n >> 2 & 0x3333u);
  n = (n + (n >> 4)) & 0x0f0fu;
  return (n + (n >> 8)) & 31u;
}

// Whether all four of a row have `value`.
inline bool all_are(const std::uint32_t* four, std::uint32_t value) {
  return ((four[0] ^ value) | (four[1] ^ value) | (four[2] ^ value) | (four[3] ^ value)) == 0;
}

inline bool is_finite(const Vec4& color) {
  return std::isfinite(color.x) && std::isfinite(color.y) && std::isfinite(color.z) && std::isfinite(color.w);
}

// Calls visit(x, y) row by row.
template <class Visit>
void for_each_pixel(IntRect pixels, const Visit& visit) {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) visit(x, y);
}

}  // namespace tessera::tilecore
