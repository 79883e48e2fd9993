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

// The machine from the front end on: it turns a posed view into images and counters. It keeps the lists as long as the
// pose stays the same.
//
// Invariant (cited by the tests):
//   PL1  Images, counters and records of a view do not depend on the views before it, except through TileJob::store,
//        TileJob::attachments, ViewRun::inputs and ViewRun::taa_history.
class Pipeline {
 public:
  using Cores = std::shared_ptr<PerThread<tilecore::TileCore>>;
  // Both must outlive it. Pipelines that render one view at a time may share the cores.
  Pipeline(const GpuConfiguration& gpu, const frontend::PyramidLibrary& pyramids,
           Cores cores = std::make_shared<PerThread<tilecore::TileCore>>())
      : gpu_(gpu), pyramids_(pyramids), cores_(std::move(cores)) {}

  // State that views leave to each other. `store`: tile cores write the farthest depths of their blocks into
  // FrameTargets::coarse_depth. `guess`: depths that hide candidates in the first pass, or nullptr.
  struct PreviousDepth {
    bool store = false;
    const frontend::CoarseDepth* guess = nullptr;  // only with `store`
  };
  // Renders a view into `run.result`, whose counters grow.
  void render(const ViewRun& run, const PreviousDepth& previous);

 private:
  // Fills kept_.front_end; cells of procedures are sub-patches behind the front end's own.
  void bound(const ViewRun& run, const PreviousDepth& previous, scene::MemoryBudget& budget);
  // Fetches the depths that the tile cores wrote, and renders again the tiles in which a candidate hidden by the guess
  // is visible.
  void second_pass(const ViewRun& run, TileScheduler& scheduler, binner::Binner& binner,
                   frontend::FrontEndResult& front_end);
  // The tiles in which `depth` does not hide all of some sub-patches; counts the blocks that the tests read.
  static std::vector<bool> tiles_again(const binner::TileGrid& grid, const frontend::CoarseDepth& depth,
                                       const std::vector<frontend::BoundedSubPatch>& visible,
                                       frontend::PreviousDepthCounters& counters);
  // Renders all of the front end's sub-patches; returns true if the lists hold all of them.
  static bool render_tiles(const ViewRun& run, TileScheduler& scheduler, const binner::TileGrid& grid,
                           const std::vector<frontend::BoundedSubPatch>& sub_patches, bool binned);
  // Counts the sub-patches whose materials have effects; tiles mark their own.
  static void find_materials(const ViewRun& run, const std::vector<frontend::BoundedSubPatch>& sub_patches);
  // Collects the counters that the tile cores keep for each drawable.
  void take_totals(const ViewRun& run);

  const GpuConfiguration& gpu_;
  const frontend::PyramidLibrary& pyramids_;
  Cores cores_;
  // Results of front end and binner for the pose rendered last, for a further frame of the same pose: the emulated
  // units do the work again, but the host does not.
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
