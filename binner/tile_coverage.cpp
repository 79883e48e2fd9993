#include "binner/tile_coverage.h"

#include "binner/coverage.h"
#include "binner/time_segments.h"

namespace tessera::binner {

TileCoverageUnit::TileCoverageUnit(const Settings& settings)
    : exact_(settings.coverage == CoverageMethod::kExact),
      time_intervals_(settings.time_intervals),
      time_segments_(settings.time_segments) {}

const TileCoverage& TileCoverageUnit::cover(const MovingBody& body, bool moving, const TileGrid& grid) {
  TileCoverage& c = coverage_;
  c.tiles = grid.covered(body.bounds);
  const auto count = static_cast<std::uint64_t>(c.tiles.width()) * static_cast<std::uint64_t>(c.tiles.height());
  c.times.assign(count, TimeInterval{});
  c.covered = count;
  c.dropped_exact = c.dropped_time = 0;
  // A rectangle inside one tile has nothing to drop; one that leaves the frame might have, but rarely.
  if (exact_ && count > 1) apply_exact(body, grid);
  if (moving && count > 0 && has_hull(body)) {
    if (time_intervals_) apply_intervals(body, grid);
    if (time_segments_ != 1) apply_segments(body, grid);
    std::uint64_t left = 0;
    for (const TimeInterval& times : c.times) left += times.empty() ? 0 : 1;
    c.dropped_time = c.covered - left;
    c.covered = left;
  }
  return c;
}

void TileCoverageUnit::apply_exact(const MovingBody& body, const TileGrid& grid) {
  const ExactCoverage exact(body, grid);
  std::size_t tile = 0;
  for (int row = coverage_.tiles.y0; row < coverage_.tiles.y1; ++row)
    for (int column = coverage_.tiles.x0; column < coverage_.tiles.x1; ++column, ++tile)
      if (!exact.touches(column, row)) {
        coverage_.times[tile] = kNoTime;
        ++coverage_.dropped_exact;
      }
  coverage_.covered -= coverage_.dropped_exact;
}

void TileCoverageUnit::apply_intervals(const MovingBody& body, const TileGrid& grid) {
  const IntRect& tiles = coverage_.tiles;
  const auto grow = static_cast<double>(body.bounds.grow);
  column_times_.clear();
  for (int column = tiles.x0; column < tiles.x1; ++column)
    column_times_.push_back(
        times_in_strip(body.corners, Axis::kX, grid.column_edge(column), grid.column_edge(column + 1), grow));
  std::size_t tile = 0;
  for (int row = tiles.y0; row < tiles.y1; ++row) {
    const TimeInterval row_times =
        times_in_strip(body.corners, Axis::kY, grid.row_edge(row), grid.row_edge(row + 1), grow);
    for (const TimeInterval& times : column_times_) {
      coverage_.times[tile] = coverage_.times[tile].intersect(times).intersect(row_times);
      ++tile;
    }
  }
}

void TileCoverageUnit::apply_segments(const MovingBody& body, const TileGrid& grid) {
  const TimeSegments segments(body, grid, time_segments_);
  std::size_t tile = 0;
  for (int row = coverage_.tiles.y0; row < coverage_.tiles.y1; ++row)
    for (int column = coverage_.tiles.x0; column < coverage_.tiles.x1; ++column, ++tile)
      coverage_.times[tile] = coverage_.times[tile].intersect(segments.times(column, row));
}

}  // namespace tessera::binner
