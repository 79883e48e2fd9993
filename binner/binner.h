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

  // Where binning stands: the next sub-patch, and how many of its entries are written.
  struct Cursor {
    std::size_t sub_patch = 0;
    std::uint32_t entry = 0;
  };

  // Bins from the cursor on, which stands at the beginning for sub-patches that were not passed before. True: all are
  // binned; false: the buffer is full.
  [[nodiscard]] bool run(const scene::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches,
                         Cursor& cursor);

  // What a tile has to render: its own queue and those of the groups around it. See ParameterBuffer::read_queue. How many
  // cells a whole patch has, its own record says.
  std::vector<ListEntry> read_tile(const scene::FrameGeometry& frame, TileIndex tile, memory::Ledger& ledger,
                                   std::uint64_t& bytes_read) const;

  // After a partial render: empty queues, same counters.
  void reset() { buffer_.reset(); }

  const TileGrid& grid() const { return grid_; }
  ParameterBuffer& buffer() { return buffer_; }
  const ParameterBuffer& buffer() const { return buffer_; }

 private:
  // Where the entries of one sub-patch go, and what coverage counted for it.
  struct Placed {
    std::vector<ListLevels::Placement> placements;
    std::uint64_t covered, dropped;
  };
  // Sub-patches whose coverage is found at once, by all threads; entries are then written in order.
  static constexpr std::size_t kAhead = 2048;

  void compute_coverage_batch(const scene::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches,
                              std::size_t first);
  void count(const Placed& placed);

  TileGrid grid_;
  ListLevels hierarchy_;
  TileCoverageUnit coverage_;  // each thread works with a copy
  ParameterBuffer buffer_;
  std::size_t ahead_first_ = 0;  // of the sub-patches in ahead_
  std::vector<Placed> ahead_;
};

}  // namespace tessera::binner
