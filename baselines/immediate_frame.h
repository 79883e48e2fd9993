#pragma once

#include <cstdint>

#include "gpu/configuration.h"
#include "gpu/machine_record.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

struct ImmediateTraffic {
  std::uint64_t bytes_read = 0, bytes_written = 0;  // through the cache of immediate.cache_bytes
  std::uint64_t bytes_uncached = 0;                 // both, without
};

// Draws the frame as an immediate-mode machine does: base patch by base patch in submission order, within one area of
// the screen (a tile) after the other, within that triangle by triangle, each against the depth that was drawn before.
// A triangle touches the lines that hold samples inside it, also where motion and defocus scatter them: exact, not
// bounded. How patches were split and binned for `record` does not matter.
ImmediateTraffic draw_immediately(const tilecore::TileJob& job, const gpu::MachineRecord& record,
                                  const gpu::GpuConfiguration& gpu);

}  // namespace tessera::baselines
