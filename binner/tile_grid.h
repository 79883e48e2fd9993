#pragma once

#include <cstdint>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

using TileIndex = std::uint32_t;

// The frame cut into tiles, row by row from the top left. Tiles at the right and bottom edge may reach past the frame;
// their rectangles are cut to it. With a region only the tiles that touch it exist, and their rectangles are cut to the
// region; pixel coordinates still count from the frame's corner.
class TileGrid {
 public:
  TileGrid(int frame_width, int frame_height, int tile_width, int tile_height, IntRect region);
  TileGrid(int frame_width, int frame_height, int tile_width, int tile_height)
      : TileGrid(frame_width, frame_height, tile_width, tile_height, {0, 0, frame_width, frame_height}) {}

  TileIndex tile_count() const { return static_cast<TileIndex>(tiles_.width() * tiles_.height()); }
  int columns() const { return tiles_.width(); }
  int rows() const { return tiles_.height(); }
  int tile_width() const { return tile_width_; }
  int tile_height() const { return tile_height_; }

  // First pixel of a column or row of this grid, in the frame; it ends where the next begins. Tiles are whole here, not
  // cut to the frame or the region.
  int column_edge(int column) const { return (tiles_.x0 + column) * tile_width_; }
  int row_edge(int row) const { return (tiles_.y0 + row) * tile_height_; }
  const IntRect& region() const { return region_; }

  // Pixels of a tile, in frame coordinates.
  IntRect pixels(TileIndex tile) const;

  // Columns and rows (of this grid) whose pixels a bound may touch; the bound is closed, so one that ends exactly on a
  // tile's edge belongs to both tiles.
  IntRect covered(const frontend::ScreenBounds& bounds) const;

  TileIndex index(int column, int row) const { return static_cast<TileIndex>(row * tiles_.width() + column); }

 private:
  int tile_width_, tile_height_;
  IntRect region_;  // pixels
  IntRect tiles_;   // tile columns and rows of the whole frame that exist here
};

}  // namespace tessera::binner
