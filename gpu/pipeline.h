#pragma once

#include "base/parallel.h"
#include "frontend/bounds/coarse_depth.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "gpu/tile_scheduler.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// The machine from the front end on: a posed view in, image and counters out. Keeps its tile cores' scratch memory from
// view to view.
class Pipeline {
 public:
  // Both must outlive it.
  Pipeline(const GpuConfiguration& gpu, const frontend::PyramidLibrary& pyramids) : gpu_(gpu), pyramids_(pyramids) {}

  // Renders a view into `run.result`, whose counters grow. `guess`: what the previous frame hides, or null.
  void render(const ViewRun& run, const frontend::OcclusionGuess* guess);

  // The farthest depth that each tile of a finished view sees, for the next frame.
  frontend::CoarseDepth coarse_depth(const tilecore::TileJob& job, const FrameResult& result) const;

 private:
  // Renders again the tiles of sub-patches that the previous frame's depth hid and that are visible after all.
  void second_pass(const ViewRun& run, TileScheduler& scheduler, binner::Binner& binner,
                   frontend::FrontEndResult& front_end);
  void collect(const ViewRun& run, const binner::Binner& binner, const tilecore::TessellationCache& cache);

  const GpuConfiguration& gpu_;
  const frontend::PyramidLibrary& pyramids_;
  PerThread<tilecore::TileCore> cores_;
};

}  // namespace tessera::gpu
