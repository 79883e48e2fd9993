#include "binner/list_levels.h"

#include <algorithm>
#include <limits>

#include "base/check.h"

namespace tessera::binner {

ListLevels::ListLevels(const TileGrid& grid, int levels)
    : levels_(levels), columns_(grid.columns()), rows_(grid.rows()) {
  TESSERA_CHECK(levels >= 1 && levels <= kMaxLevels, "binner.queue_levels is in range");
  std::uint64_t count = 0;
  for (int level = 0; level < levels_; ++level) {
    count += static_cast<std::uint64_t>(groups_across(level)) * static_cast<std::uint64_t>(groups_down(level));
    TESSERA_CHECK(count <= std::numeric_limits<QueueIndex>::max(), "queue numbers fit 32 bits");
    first_[level + 1] = static_cast<QueueIndex>(count);
  }
}

void ListLevels::place(const TileCoverage& coverage, std::uint64_t patch_bytes, std::vector<Placement>& out) const {
  out.clear();
  if (coverage.tiles.empty()) return;
  const Costs costs{coverage, kReadBytes + patch_bytes};
  const int top = levels_ - 1;
  for (int row = coverage.tiles.y0 >> top; row <= (coverage.tiles.y1 - 1) >> top; ++row)
    for (int column = coverage.tiles.x0 >> top; column <= (coverage.tiles.x1 - 1) >> top; ++column)
      place_group(costs, top, column, row, out);
}

// Appends the cheapest entries for the covered tiles of a group; returns the bytes that they move.
std::uint64_t ListLevels::place_group(const Costs& costs, int level, int column, int row,
                                      std::vector<Placement>& out) const {
  const TileCoverage& coverage = costs.coverage;
  if (level == 0) {
    if (!coverage.tiles.contains(column, row) || coverage.at(column, row).empty()) return 0;
    out.push_back({queue(0, column, row), coverage.at(column, row)});
    return kWrittenBytes + costs.tile_bytes;
  }
  const IntRect group = IntRect{column << level, row << level, (column + 1) << level, (row + 1) << level}.intersect(
      {0, 0, columns_, rows_});
  if (group.intersect(coverage.tiles).empty()) return 0;
  const std::size_t first = out.size();
  std::uint64_t fine = 0;
  for (int child = 0; child < 4; ++child)
    fine += place_group(costs, level - 1, 2 * column + child % 2, 2 * row + child / 2, out);
  if (out.size() < first + 2) return fine;
  const std::uint64_t tiles = static_cast<std::uint64_t>(group.width()) * static_cast<std::uint64_t>(group.height());
  const std::uint64_t one = kWrittenBytes + tiles * costs.tile_bytes;
  if (one >= fine) return fine;
  TimeInterval times = kNoTime;
  for (std::size_t k = first; k < out.size(); ++k) times = times.hull(out[k].times);
  out.resize(first);
  out.push_back({queue(level, column, row), times});
  return one;
}

}  // namespace tessera::binner
