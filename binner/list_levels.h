#pragma once

#include <cstdint>
#include <vector>

#include "binner/tile_coverage.h"
#include "binner/tile_grid.h"
#include "binner/tile_lists.h"
#include "binner/time_interval.h"

namespace tessera::binner {

// Lists of single tiles (level 0) and of groups of 2^L x 2^L tiles, aligned to the grid's top left. A tile core reads
// the list of its tile and the lists of the groups around it. Configured by binner.queue_levels.
//
// Lists are numbered level by level, row by row; a list of level 0 has the number of its tile.
class ListLevels {
 public:
  static constexpr int kMaxLevels = 5;
  // Bytes that an entry is assumed to move: written to a list; read from the list and from the sub-patch table.
  static constexpr std::uint64_t kWrittenBytes = 2, kReadBytes = 2 + 16;

  ListLevels(const TileGrid& grid, int levels);

  QueueIndex queue_count() const { return first_[static_cast<std::size_t>(levels_)]; }
  QueueIndex queue(int level, int column, int row) const {
    return first_[static_cast<std::size_t>(level)] + static_cast<QueueIndex>(row * groups_across(level) + column);
  }

  // Calls visit(QueueIndex) for the list of a tile and for the lists of the groups that contain it, from fine to
  // coarse.
  template <class Visit>
  void for_each_queue_of(TileIndex tile, const Visit& visit) const {
    const int column = static_cast<int>(tile) % columns_, row = static_cast<int>(tile) / columns_;
    for (int level = 0; level < levels_; ++level) visit(queue(level, column >> level, row >> level));
  }

  // An entry to write; `times` is the hull of the times of its tiles.
  struct Placement {
    QueueIndex queue;
    TimeInterval times;
  };

  // Chooses the lists for a sub-patch so that every covered tile reads exactly one entry. One entry in a group's list
  // replaces several finer ones when that moves fewer bytes: the entry is written once, but all tiles of the group read
  // it, and the uncovered ones fetch `patch_bytes` of the patch in vain. (Counting writes alone would send everything
  // to the coarsest level.) Ties go to the finer entries; groups are decided from fine to coarse. With one level the
  // order is row by row.
  void place(const TileCoverage& coverage, std::uint64_t patch_bytes, std::vector<Placement>& out) const;

 private:
  struct Costs {
    const TileCoverage& coverage;
    std::uint64_t tile_bytes;  // that a tile moves for each entry it reads
  };
  int groups_across(int level) const { return (columns_ + (1 << level) - 1) >> level; }
  int groups_down(int level) const { return (rows_ + (1 << level) - 1) >> level; }
  std::uint64_t place_group(const Costs& costs, int level, int column, int row, std::vector<Placement>& out) const;

  int levels_, columns_, rows_;
  QueueIndex first_[kMaxLevels + 1] = {};
};

}  // namespace tessera::binner
