#pragma once

#include <vector>

#include "binner/coverage.h"
#include "binner/settings.h"
#include "binner/tile_grid.h"
#include "binner/time_interval.h"

namespace tessera::binner {

// The covered tiles of the bounding rectangle and their times, row by row; an uncovered tile has an empty interval.
struct TileCoverage {
  IntRect tiles;                    // bounding rectangle, in columns and rows of the grid
  std::vector<TimeInterval> times;  // one per tile of the rectangle
  std::uint64_t covered = 0;        // tiles with times
  std::uint64_t dropped_exact = 0;  // tiles that the hull of the moving box misses
  std::uint64_t dropped_time = 0;   // tiles that the hull touches, but at no time

  const TimeInterval& at(int column, int row) const { return times[tiles.index(column, row)]; }
};

// Finds the tiles that a sub-patch may touch: bounding rectangle, then exact coverage, then time intervals, then time
// segments, each if selected. Configured by binner.coverage, binner.time_intervals, binner.time_segments. Keeps
// its memory from call to call.
//
// Every method is conservative by itself, so their intersection is. Sub-patches that do not move have [0, 255]. Raises
// neither the invalid nor the divide-by-zero flag for finite corners.
class TileCoverageUnit {
 public:
  explicit TileCoverageUnit(const Settings& settings);

  const TileCoverage& cover(const MovingBody& body, bool moving, const TileGrid& grid);

 private:
  void apply_exact(const MovingBody& body, const TileGrid& grid);
  void apply_intervals(const MovingBody& body, const TileGrid& grid);
  void apply_segments(const MovingBody& body, const TileGrid& grid);

  bool exact_, time_intervals_;
  int time_segments_;
  TileCoverage coverage_;
  std::vector<TimeInterval> column_times_;
};

}  // namespace tessera::binner
