#pragma once

#include "base/rect.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Bit of pixel (x, y) of the frame within its block of 4x4 pixels. Blocks lie on multiples of four pixels of the frame.
constexpr BlockMask block_bit(int x, int y) { return static_cast<BlockMask>(1u << (4 * (y & 3) + (x & 3))); }

// A byte per pixel of a row of four from its bits, 0 or 1.
constexpr std::uint32_t row_bytes(unsigned bits) {
  return (bits & 1u) | (bits & 2u) << 7 | (bits & 4u) << 14 | (bits & 8u) << 21;
}

// Calls visit(x, y) row by row.
template <class Visit>
void for_each_pixel(IntRect pixels, const Visit& visit) {
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) visit(x, y);
}

}  // namespace tessera::tilecore
