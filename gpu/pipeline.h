#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "frontend/bounds/coarse_depth.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "gpu/tile_scheduler.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// The machine from the front end on: a posed view in, image and counters out. Keeps lists while the
// pose is the same.
//
// Invariant (cited by the tests):
//   PL1  Images, counters and records of a view do not depend on the views before it, but for what TileJob::store and
//        ViewRun::inputs bring from them.
class Pipeline {
 public:
  using Cores = std::shared_ptr<PerThread<tilecore::TileCore>>;
  // Both must outlive it. Pipelines that render one view at a time may have the same cores.
  Pipeline(const GpuConfiguration& gpu, const frontend::PyramidLibrary& pyramids,
           Cores cores = std::make_shared<PerThread<tilecore::TileCore>>())
      : gpu_(gpu), pyramids_(pyramids), cores_(std::move(cores)) {}

  // What views leave to each other. `store`: tile cores write the farthest depths of their blocks, into
  // FrameTargets::coarse_depth. `guess`: what hides things at first, or null.
  struct PreviousDepth {
    bool store = false;
    const frontend::CoarseDepth* guess = nullptr;  // only with `store`
  };
  // Renders a view into `run.result`, whose counters grow.
  void render(const ViewRun& run, const PreviousDepth& previous);

 private:
  // Fills kept_.front_end; cells of procedures are sub-patches behind those of the front end.
  void bound(const ViewRun& run, const PreviousDepth& previous, scene::MemoryBudget& budget);
  // Fetches the depths that the tile cores wrote, and renders again the tiles in which they do not hide what the guess
  // hid.
  void second_pass(const ViewRun& run, TileScheduler& scheduler, binner::Binner& binner,
                   frontend::FrontEndResult& front_end);
  // The tiles in which `depth` does not hide all of some sub-patches; counts the blocks that it takes to say so.
  static std::vector<bool> tiles_again(const binner::TileGrid& grid, const frontend::CoarseDepth& depth,
                                       const std::vector<frontend::BoundedSubPatch>& visible,
                                       frontend::PreviousDepthCounters& counters);
  // All of the front end's sub-patches; true: the lists hold all of them.
  static bool render_tiles(const ViewRun& run, TileScheduler& scheduler, const binner::TileGrid& grid,
                           const std::vector<frontend::BoundedSubPatch>& sub_patches, bool binned);
  // Counts the sub-patches whose materials have effects; tiles mark their own.
  static void find_materials(const ViewRun& run, const std::vector<frontend::BoundedSubPatch>& sub_patches);
  // Collects the counters that the tile cores keep for each drawable.
  void take_totals(const ViewRun& run);

  const GpuConfiguration& gpu_;
  const frontend::PyramidLibrary& pyramids_;
  Cores cores_;
  // What front end and binner made of the pose rendered last, for a further frame of the same pose: the emulated units
  // do the same again, the host does not.
  struct Kept {
    std::uint64_t pose = 0;  // scene::FrameGeometry::identity; 0: none
    frontend::FrontEndResult front_end;
    std::optional<binner::Binner> binner;
    bool binned = false;  // the lists hold all sub-patches

    void clear() {
      pose = 0;
      front_end = {};
      binner.reset();
      binned = false;
    }
  };
  Kept kept_;
};

}  // namespace tessera::gpu
