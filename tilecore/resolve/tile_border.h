#pragma once

#include <utility>

#include "base/rect.h"
#include "tilecore/resolve/packed_stencil.h"

namespace tessera::tilecore {

// Stencils that stop at a tile's border would extrapolate pixels on the border that lie beyond a quarter's samples.
// There the samples' rows and columns continue to the border: every second pixel along it is shaded. At every rate a
// tile's corner is shaded.
//
// Invariants (cited by the tests):
//   TLB1  With border_line() every pixel of a block lies between rendered pixels, or on one.
//   TLB2  Blocks away from borders do not change; nor, except at corners, do patterns that have a sample in every row and
//        column.

// Sides of the block that are borders of the tile.
constexpr unsigned tile_borders(const IntRect& tile, const IntRect& block) {
  return (block.x0 == tile.x0 ? kLeftBorder : 0u) | (block.x1 == tile.x1 ? kRightBorder : 0u) |
         (block.y0 == tile.y0 ? kTopBorder : 0u) | (block.y1 == tile.y1 ? kBottomBorder : 0u);
}

// The pixels that are rendered besides `pattern` (pattern_dither.h) in a block whose columns [x0, x1) and rows [y0, y1)
// exist.
constexpr BlockMask border_line(BlockMask pattern, unsigned borders, int x0 = 0, int y0 = 0, int x1 = 4, int y1 = 4) {
  unsigned columns = 0, rows = 0;  // with a sample
  for (int i = 0; i < 4; ++i) {
    const unsigned row = static_cast<unsigned>(pattern) >> (4 * i) & 15u;
    columns |= row;
    rows |= row != 0 ? 1u << i : 0u;
  }
  unsigned wide = columns, high = rows;
  const auto reach = [](unsigned& line, bool border, int at) {
    if (border && (line >> at & 1u) == 0) line |= 1u << at;
  };
  reach(wide, (borders & kLeftBorder) != 0, x0), reach(wide, (borders & kRightBorder) != 0, x1 - 1);
  reach(high, (borders & kTopBorder) != 0, y0), reach(high, (borders & kBottomBorder) != 0, y1 - 1);
  unsigned lines = 0;
  for (int y = 0; y < 4 && (wide != columns || high != rows); ++y)
    if (high >> y & 1u) lines |= wide << (4 * y);
  for (const auto& [side, x] : {std::pair{kLeftBorder, x0}, {kRightBorder, x1 - 1}})
    for (const auto& [end, y] : {std::pair{kTopBorder, y0}, {kBottomBorder, y1 - 1}})
      if ((borders & side) != 0 && (borders & end) != 0) lines |= 1u << (4 * y + x);
  return static_cast<BlockMask>(lines & ~static_cast<unsigned>(pattern));
}

}  // namespace tessera::tilecore
