#include "binner/tile_grid.h"

#include <algorithm>
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
  const int column = tiles_.x0 + static_cast<int>(tile) % tiles_.width(),
            row = tiles_.y0 + static_cast<int>(tile) / tiles_.width();
  return IntRect{column * tile_width_, row * tile_height_, (column + 1) * tile_width_, (row + 1) * tile_height_}
      .intersect(region_);
}

IntRect TileGrid::covered(const frontend::ScreenBounds& b) const {
  // Columns are clamped to one beyond the grid on each side, so that a bound outside gives an empty range.
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

}  // namespace tessera::binner
