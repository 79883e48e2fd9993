#pragma once

#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "baselines/strip_code.h"

namespace tessera::baselines {

// Indices of a block that consists of rectangles of grids, which takes less than a strip (strip_code.h) unless so much
// is culled that few triangles are left.
//
// Per rectangle a byte: bits 0..2 cells along u less one, 3..5 cells along v less one, 6 whether triangles are missing.
// If so, a mask of whole bytes: bits 2k and 2k+1 say whether triangles (a, c, d) and (a, b, c) of cell k are there; cells
// go row by row along u, their corners are a (i, j), b (i+1, j), c (i+1, j+1), d (i, j+1). Vertices are numbered row by
// row, unused ones left out, on from those of the rectangle before.
inline constexpr int kGridCells = 7;  // along a side: 8x8 vertices, 98 triangles

struct GridRectangle {
  std::uint8_t columns = 1, rows = 1;
  std::bitset<std::size_t{2} * kGridCells * kGridCells> triangles;
};

std::vector<std::uint8_t> encode_grids(std::span<const GridRectangle> rectangles);

// `count` triangles, in order.
std::vector<BlockTriangle> decode_grids(std::span<const std::uint8_t> bytes, std::size_t count);

}  // namespace tessera::baselines
