#pragma once

#include <span>

#include "binner/parameter_buffer.h"
#include "binner/tile_grid.h"
#include "frontend/front_end.h"

namespace tessera::binner {

// Sorts bounded sub-patches into the tile queues. When the parameter buffer runs full it stops; the caller renders all
// tiles, calls reset() and continues at the same cursor. Nothing is lost and nothing is binned twice.
class Binner {
 public:
  Binner(const hardware::GpuConfiguration& gpu, const TileGrid& grid) : grid_(grid), buffer_(gpu, grid.tile_count()) {}

  // Where binning stands: the next sub-patch, and how many of its tiles are done.
  struct Cursor {
    std::size_t sub_patch = 0;
    std::uint32_t tile = 0;
  };

  // Bins from the cursor on. True: all are binned; false: the buffer is full.
  [[nodiscard]] bool run(const frontend::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches, Cursor& cursor);

  // After a partial render: empty queues, same counters.
  void reset() { buffer_.reset(); }

  const TileGrid& grid() const { return grid_; }
  ParameterBuffer& buffer() { return buffer_; }
  const ParameterBuffer& buffer() const { return buffer_; }

 private:
  TileGrid grid_;
  ParameterBuffer buffer_;
};

}  // namespace tessera::binner
