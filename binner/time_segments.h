#pragma once

#include <array>
#include <cstddef>

#include "binner/coverage.h"
#include "binner/tile_grid.h"
#include "binner/time_interval.h"

namespace tessera::binner {

// The shutter cut into equal pieces, each with the bounding rectangle that the moving box has during it. A tile is
// covered during the hull of the segments whose rectangle touches it, and not at all when none does.
class TimeSegments {
 public:
  static constexpr int kMax = 16;

  // `count` 1 to kMax; 0: chosen_count(). Bodies without a hull (has_hull) keep one segment with the rectangle
  // of the whole shutter.
  TimeSegments(const MovingBody& body, const TileGrid& grid, int count);

  int count() const { return count_; }
  TimeInterval times(int column, int row) const;

  // Blur length over primitive size: the distance that the box's centre travels on screen, in units of the box's larger
  // side (or the tile's, if larger), rounded up; 1 to kMax.
  static int chosen_count(const MovingBody& body, const TileGrid& grid);

 private:
  struct Segment {
    TimeInterval codes;
    IntRect tiles;  // columns and rows of the grid
  };
  int count_ = 1;
  std::array<Segment, kMax> segments_;
};

// Rectangle around the projections of the moving box at time `t`, which covers (1-t) p + t q for *all* points p of the
// box at key 0 and q of the box at key 1. The body must satisfy has_hull().
struct ScreenBox {
  double x0, y0, x1, y1;
};
ScreenBox screen_box_at(const frontend::MovingCorners& corners, double t);

}  // namespace tessera::binner
