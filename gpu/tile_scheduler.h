#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "frontend/front_end.h"
#include "gpu/frame_result.h"
#include "gpu/input_signatures.h"
#include "gpu/observed_work.h"
#include "gpu/work_progress.h"
#include "gpu/work_recorder.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// A run of the machine over one view: what the scheduler works on and into.
struct ViewRun {
  const GpuConfiguration& gpu;
  const tilecore::TileJob& job;
  WorkRecorder& recorder;
  FrameResult& result;
  ObservedWork* record;  // nullptr if nobody observes the frame
  WorkProgress* progress = nullptr;
  InputSignatures* inputs = nullptr;  // rendering elimination; null: all tiles are rendered
  std::string_view pass = "main";     // name of its last pass, or only one
  std::uint32_t first_tile = 0;       // WorkRecorder::begin_view()
  bool waits = true;                  // the geometry of its first pass does, for the tiles of all passes before
};

// Gives tiles to the tile cores, in rounds: the binner fills the parameter buffer, all tiles render what their lists
// hold. A buffer that was too small leads to a round of partial renders and to a further round. What transmits is
// rendered in a pass of its own.
//
// Tiles go to any thread, begun in the machine's order (tilecore.tile_order). Counters and images do not depend on it:
// what tiles share they use in that order, while later tiles are rendered.
class TileScheduler {
 public:
  // Called when a pass has ended, with its name.
  using PassEnd = std::function<void(std::string_view)>;
  TileScheduler(const ViewRun& run, PerThread<tilecore::TileCore>& cores, binner::Binner& binner,
                const tilecore::TileOrder& order, tilecore::TessellationCache& cache, PassEnd pass_end);

  // Bins, renders and finishes tiles: all of them, or those that `only` marks. `binned`: the lists hold all already.
  void render(std::string_view pass, std::span<const frontend::BoundedSubPatch> sub_patches,
              const std::vector<bool>& only, bool binned = false) {
    render_pass(sub_patches, {pass, only, {}, binned, waits_for_passes()});
  }

  // Where something transmits: what does not, in all tiles, of which `open` marks those that are not finished; then, once
  // the image of what is behind has its smaller levels, these again with all that the lists hold.
  void render_behind(std::span<const frontend::BoundedSubPatch> sub_patches, const std::vector<bool>& open) {
    render_pass(sub_patches, {"behind", {}, open, false, waits_for_passes()});
  }
  void render_transmissive(std::span<const frontend::BoundedSubPatch> sub_patches, const std::vector<bool>& open) {
    reduce_behind();
    // The lists grow by what transmits while those of the pass before are read.
    render_pass(sub_patches, {"main", open, {}, false, run_.result.counters.binner.partial_renders > 0});
  }

  // Of all tiles, and the sub-patch table.
  void empty_lists();

  // A round of what the recorder got, without lists or tiles.
  void record_empty_round(std::string_view pass) {
    (void)run_.recorder.begin_round(binner_, order_, {pass});
    pass_end_(pass);
  }

  // What the depths take that tile cores store for the next frame: 2 bytes a block, tile by tile in the machine's order.
  std::uint64_t depth_bytes() const { return tile_depth_bytes() * binner_.grid().tile_count(); }

  // What resolve stencils that reach into neighbouring tiles left open, when every tile is finished.
  void finish_across_tiles();

 private:
  struct Round;
  // Whether the geometry of the pass at hand waits for all passes before.
  bool waits_for_passes() { return std::exchange(first_pass_, false) ? run_.waits : true; }
  // `only`: the tiles that are rendered; `open`: those that leave what is behind and are not finished. Empty: all; none.
  struct Pass {
    std::string_view name;
    std::vector<bool> only, open;
    bool binned = false;
    bool waits = true;  // its geometry does, for the tiles of the pass before
  };
  void render_pass(std::span<const frontend::BoundedSubPatch> sub_patches, const Pass& pass);
  // Smaller levels of the image of what is behind.
  void reduce_behind();
  // What the tiles' parts of a level of it move.
  void share_behind(WorkRecorder::Round& round, int level, bool write);
  // False: the tile will be rendered again with what transmits.
  bool finish_tile(const Round& round, std::size_t tile, tilecore::TileState& state);
  // Ends work on a tile that is neither its first nor its last.
  void end_part(tilecore::TileCore& core, WorkRecorder::Tile& work, std::size_t tile);
  void render_tile(Round& round, std::size_t tile);
  // Which tiles need not be rendered; empty: all do. `complete`: the lists hold all sub-patches.
  std::vector<bool> compare_inputs(bool complete);
  std::uint64_t tile_depth_bytes() const;
  SignatureMemory signature_memory() const;
  // The flags of a map's tiles.
  void share_flags(Round& round);
  // What signatures of the tiles' colours move.
  void share_signatures(Round& round);
  // Replays a rendered tile's requests to the units that all tiles share. Called tile by tile, in emulated order.
  void share(Round& round, binner::TileIndex tile);

  const ViewRun& run_;
  PerThread<tilecore::TileCore>& cores_;
  binner::Binner& binner_;
  const tilecore::TileOrder& order_;
  tilecore::TessellationCache& cache_;
  PassEnd pass_end_;
  bool first_pass_ = true;
  std::uint32_t records_before_ = 0;  // of the sub-patch tables that were emptied
};

}  // namespace tessera::gpu
