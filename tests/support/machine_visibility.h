#pragma once

#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "gpu/configuration.h"
#include "tilecore/tile_core.h"

namespace tessera::test {

// The machine without its shading: posed frame -> front end -> binner -> tile cores, until every sample knows its
// surface. For programs that compare visibility, or time it, alone. Keeps the tile cores' scratch memory between
// runs, as the replay does; all counters and ledgers are on.
class MachineVisibility {
 public:
  MachineVisibility(const gpu::GpuConfiguration& gpu, const tilecore::SamplePattern& pattern,
                    const binner::TileGrid& grid)
      : gpu_(gpu), pattern_(pattern), grid_(grid) {}

  struct Stages {
    double bound_seconds = 0, bin_seconds = 0, tile_seconds = 0;
    double total() const { return bound_seconds + bin_seconds + tile_seconds; }
  };
  struct Result {
    std::vector<tilecore::TileState> tiles;              // by tile, when they are kept; else empty
    std::vector<frontend::BoundedSubPatch> sub_patches;  // that went to the binner
    tilecore::TileCoreCounters counters;
    tilecore::TessellationCounters tessellation;
    Stages stages;
  };
  // `force_motion` uses the ray path although nothing moves; `kernels`: see TileJob.
  Result run(const scene::FrameGeometry& frame, const frontend::PyramidLibrary& pyramids, bool keep_tiles,
             bool force_motion = false, const tilecore::VisibilityKernels* kernels = nullptr);

 private:
  gpu::GpuConfiguration gpu_;
  const tilecore::SamplePattern& pattern_;
  binner::TileGrid grid_;
  PerThread<tilecore::TileCore> cores_;
  PerThread<tilecore::TileState> states_;
};

}  // namespace tessera::test
