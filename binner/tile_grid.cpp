#include "binner/tile_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tessera::binner {
namespace {

// Tile number of a coordinate, clamped so that no float is out of an int's range; NaN becomes `low`.
int tile_of(float coordinate, int size, int low, int high) {
  const double tile = std::floor(static_cast<double>(coordinate) / size);
  if (!(tile > low)) return low;
  return tile < high ? static_cast<int>(tile) : high;
}

}  // namespace

TileGrid::TileGrid(int frame_width, int frame_height, int tile_width, int tile_height, IntRect region)
    : tile_width_(tile_width),
      tile_height_(tile_height),
      region_(region.intersect({0, 0, frame_width, frame_height})),
      tiles_{region_.x0 / tile_width, region_.y0 / tile_height, (region_.x1 + tile_width - 1) / tile_width,
             (region_.y1 + tile_height - 1) / tile_height} {}

IntRect TileGrid::pixels(TileIndex tile) const {
  const int column = tiles_.x0 + static_cast<int>(tile) % tiles_.width(), row = tiles_.y0 + static_cast<int>(tile) / tiles_.width();
  return IntRect{column * tile_width_, row * tile_height_, (column + 1) * tile_width_, (row + 1) * tile_height_}.intersect(region_);
}

IntRect TileGrid::covered(const frontend::ScreenBounds& b) const {
  // Columns are clamped to one beyond the grid on each side, so that what lies outside gives an empty range.
  const auto first = [](float low, int size, int begin, int end) {
    // Closed on the inner side: a bound that starts on a tile's left edge also touches the tile before it.
    const int tile = tile_of(low, size, begin - 1, end);
    return tile > begin && static_cast<double>(low) == static_cast<double>(tile) * size ? tile - 1 : tile;
  };
  const int x0 = std::max(first(b.x0, tile_width_, tiles_.x0, tiles_.x1), tiles_.x0);
  const int y0 = std::max(first(b.y0, tile_height_, tiles_.y0, tiles_.y1), tiles_.y0);
  const int x1 = std::min(tile_of(b.x1, tile_width_, tiles_.x0 - 1, tiles_.x1), tiles_.x1 - 1);
  const int y1 = std::min(tile_of(b.y1, tile_height_, tiles_.y0 - 1, tiles_.y1), tiles_.y1 - 1);
  return {x0 - tiles_.x0, y0 - tiles_.y0, x1 + 1 - tiles_.x0, y1 + 1 - tiles_.y0};
}

std::vector<TileIndex> TileGrid::walk(bool z_curve) const {
  std::vector<TileIndex> tiles;
  tiles.reserve(tile_count());
  if (!z_curve) {
    for (TileIndex t = 0; t < tile_count(); ++t) tiles.push_back(t);
    return tiles;
  }
  // Squares of halving side, those outside left out; on the frame's grid, so that a region's tiles keep their order.
  const auto visit = [&](const auto& self, int column, int row, int side) -> void {
    if (column >= tiles_.x1 || row >= tiles_.y1 || column + side <= tiles_.x0 || row + side <= tiles_.y0) return;
    if (side == 1) {
      tiles.push_back(index(column - tiles_.x0, row - tiles_.y0));
      return;
    }
    const int half = side / 2;
    for (int quarter = 0; quarter < 4; ++quarter) self(self, column + (quarter & 1) * half, row + (quarter >> 1) * half, half);
  };
  visit(visit, 0, 0, static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max({tiles_.x1, tiles_.y1, 1})))));
  return tiles;
}

}  // namespace tessera::binner
