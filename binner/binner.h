#pragma once

#include <span>
#include <vector>

#include "binner/list_levels.h"
#include "binner/parameter_buffer.h"
#include "binner/tile_coverage.h"
#include "binner/tile_grid.h"
#include "frontend/front_end.h"

namespace tessera::binner {

// The list builder: sorts bounded sub-patches into the lists of tiles and groups of tiles. When the parameter buffer
// runs full it stops; the caller renders all tiles, calls reset() and continues at the same cursor. Nothing is lost and
// nothing is binned twice.
class Binner {
 public:
  Binner(const BinnerSpec& spec, const TileGrid& grid)
      : grid_(grid),
        hierarchy_(grid, spec.binner.queue_levels),
        coverage_(spec.binner),
        buffer_(spec, hierarchy_.queue_count()) {}

  // The cursor of binning: the next sub-patch, and how many of its entries are written.
  struct Cursor {
    std::size_t sub_patch = 0;
    std::uint32_t entry = 0;
  };

  // Bins from the cursor on; for sub-patches that were not passed before, the caller sets it to the beginning. Returns
  // true when all sub-patches are binned, false when the buffer is full.
  [[nodiscard]] bool run(const scene::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches,
                         Cursor& cursor);

  // The entries that a tile renders: its own list and the lists of the groups around it (ParameterBuffer::read_queue).
  // The cell count of a whole patch comes from the patch's own record.
  std::vector<ListEntry> read_tile(const scene::FrameGeometry& frame, TileIndex tile, memory::Ledger& ledger,
                                   std::uint64_t& bytes_read) const;

  // Empties the lists after a partial render; the counters stay.
  void reset() { buffer_.reset(); }

  const TileGrid& grid() const { return grid_; }
  ParameterBuffer& buffer() { return buffer_; }
  const ParameterBuffer& buffer() const { return buffer_; }

 private:
  // Destinations of the entries of one sub-patch, and the tiles that coverage counted for it.
  struct Placed {
    std::vector<ListLevels::Placement> placements;
    std::uint64_t covered, dropped;
  };
  // All threads compute the coverage of this many sub-patches at once; their entries are then written in order.
  static constexpr std::size_t kAhead = 2048;

  void compute_coverage_batch(const scene::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches,
                              std::size_t first);
  void count(const Placed& placed);

  TileGrid grid_;
  ListLevels hierarchy_;
  TileCoverageUnit coverage_;  // each thread works with a copy
  ParameterBuffer buffer_;
  std::size_t ahead_first_ = 0;  // sub-patch number of ahead_[0]
  std::vector<Placed> ahead_;
};

}  // namespace tessera::binner
