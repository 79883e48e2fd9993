#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "binner/parameter_buffer.h"
#include "binner/tile_grid.h"
#include "scene/frame_geometry.h"
#include "tilecore/frame_targets.h"
#include "tilecore/resolve/surface_velocities.h"
#include "tilecore/shading/alpha_test.h"
#include "tilecore/shading/deferred_shader.h"
#include "tilecore/tessellation/mesh_store.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_result.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/tile_frustum.h"

namespace tessera::tilecore {

// Cost of a pass over an image for a texel: bilinear lookups; clocks of a lane and registers.
struct ImageShader {
  std::uint32_t lookups = 0, clocks = 0, registers = 0;
};

// One tile core: renders tile after tile with its own scratch memory. One instance per thread.
//
//   entries of -> order    -> cull      -> tessellate -> moving -> raster or -> visible
//   the tile      by depth    hidden                     boxes     ray path     samples
//   all entries done -> shade visible samples -> blend -> resolve -> store pixels
class TileCore {
 public:
  // Tests the sub-patches of `entries` against the tile's samples; `state` gathers the surfaces that they see. May be
  // called several times for one tile (partial renders); the result does not depend on the division or order of the
  // entries.
  void render_entries(const TileJob& job, binner::TileIndex tile, std::vector<binner::ListEntry> entries,
                      TileState& state);

  // Shades, blends, resolves and writes the pixels of the tile that render_entries was last called for.
  // `write_scene_color`: also leaves the opaque surfaces in job.scene_color.
  void finish(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets,
              bool write_scene_color = false);
  // Instead, with a G-buffer in memory: fills the tile's part of it. Then, when it is in memory, lights, blends, resolves and
  // writes the pixels; take_result() tells the two apart, and nothing else may be done in between.
  void fill(const TileJob& job, binner::TileIndex tile, TileState& state);
  void light(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets);
  // Instead, of a prepass: the depths of the tile's samples.
  std::vector<float> prepass_depths(const TileState& state);
  // Replaces finish() if job.depths is set: stores the depths of the tile's samples.
  void finish_depths(const TileJob& job, binner::TileIndex tile, const TileState& state);
  // Replaces finish() for a tile that will be rendered again with transmissive surfaces: leaves the opaque ones in
  // job.scene_color.
  void finish_scene_color(const TileJob& job, binner::TileIndex tile, const TileState& state);
  // Charges the tile for its part of the smaller levels of job.scene_color.
  void count_reduced(const TileJob& job, binner::TileIndex tile);

  // Charge the traffic of a tile that loads the present colours at the place of its store, if `actions` load them, or an
  // attachment. The recorder charges headers, and raw pixels of attachments.
  void load_colors(const TileJob& job, binner::TileIndex tile, const AttachmentActions& actions);
  void load_attachment(const TileJob& job, binner::TileIndex tile, const ColorAttachment& attachment);
  // Stores the finished colours of a tile again; `actions`: of a pass that copies them; `samples`: of each pixel that it loads
  // and resolves.
  void copy(const TileJob& job, binner::TileIndex tile, int samples, const AttachmentActions& actions,
            FrameTargets& targets);
  // Charges the tile for a shader that makes so many texels of an image.
  void run_image_shader(const TileJob& job, std::uint64_t texels, const ImageShader& shader);

  // Makes room in the history that all tiles write. With job.resolve; call it once, before any tile.
  static void begin_resolve(const TileJob& job);

  // Fills the pixels that stencils left open because they reach into neighbouring tiles. With job.resolve, after all
  // tiles are finished.
  void finish_deferred(const TileJob& job, binner::TileIndex tile, FrameTargets& targets);

  // Charges the traffic of storing and loading an unfinished tile.
  void store_state(const TileJob& job, const TileState& state);
  void load_state(const TileJob& job, const TileState& state);

  // Codes the tile's part of the G-buffer that fill() left.
  void encode_gbuffer(const TileJob& job, const TileState& state, TexelEncoder& encoder) const {
    shader_.encode_gbuffer(job, samples_, state, encoder);
  }
  // Adds work of storing or loading texels.
  void count(const StoreCounters& work) { tessera::merge(result_.counters.store, work); }

  // Adds traffic on behalf of this core that another unit counted (its list's bursts).
  void charge(const memory::Ledger& ledger) { result_.ledger += ledger; }

  // Finds all samples that a single entry touches, hidden or not, for machines that draw in another order: call
  // begin_tile(), then find_hits() for the entries in any order. Alpha is not tested, and no state is kept.
  void begin_tile(const TileJob& job, binner::TileIndex tile) {
    prepare_samples(job, job.grid->pixels(tile), has_lens(job));
  }
  void find_hits(const TileJob& job, const binner::ListEntry& entry, HitSink& sink);
  // Work of the visibility units since the last result; modulo 2^32.
  timing::SubPatchItem counted() const;

  // Chooses whether results from now on list the work of the units for each sub-patch and warp.
  void keep_items(bool keep);
  // Sends this core's transfers also to `log`, until the next result.
  void record_accesses(memory::AccessLog* log) {
    result_.ledger.record_into(log);
    resolve_.record_accesses(log);
  }

  // The results since the last call: of one tile, if it is called after each.
  TileResult take_result();
  // The totals of all tiles since the last call.
  CoreTotals take_totals() { return std::exchange(totals_, {}); }

 private:
  static bool has_lens(const TileJob& job) { return job.frame->projection.lens_scale != 0 || job.forced.lens; }
  // Returns the frame by which an entry's sub-patch moves, and sets the samples to its segment of motion.
  const scene::FrameGeometry& enter(const TileJob& job, const binner::ListEntry& entry);
  void leave_segment(const TileJob& job) {
    if (!samples_.part.whole()) samples_.enter(*job.pattern, 0, static_cast<float>(job.frame->projection.lens_scale));
  }
  // Stores a tile's colours at the destination of a pass with these actions. `open`: some pixels are still to be
  // filled.
  void store_colors(const TileJob& job, binner::TileIndex tile, const AttachmentActions& actions, bool open,
                    FrameTargets& targets);
  // Makes the colours of a tile's pixels from the shaded samples. An attachment that keeps every sample rounds them first.
  void resolve_samples(const TileJob& job, const IntRect& pixels, FrameTargets& targets);
  // Fills the tile's part of job.velocities, and charges the work.
  void write_velocities(const TileJob& job, TileState& state);
  // Writes the outputs besides colours that were asked for.
  void write_maps(TileState& state, FrameTargets& targets) const;
  // Writes the farthest depths of the tile's blocks.
  void store_coarse_depth(TileState& state, frontend::CoarseDepth& depth);
  static HistoryStorage history_storage(const TileJob& job);
  // Returns true if its second pass has pixels left to fill.
  bool finish_desampled(const TileJob& job, TileState& state, FrameTargets& targets);
  // Keeps the counts since `before` as an item. `drawable`: SubPatchItem::drawable.
  void keep_item(const timing::SubPatchItem& before, std::uint32_t drawable);
  // Charges the tile for samples that its memory has no room for.
  void spill(const TileJob& job, const TileState& state);
  // Effects that the kernels for an entry need: effects of the scene that the front end did not rule out, and forced
  // ones.
  struct EntryEffects {
    RayEffects ray;
    bool displaced, alpha_tested;
  };
  DrawableCounts& counts_of(const TileJob& job, const binner::ListEntry& entry) {
    return totals_.drawables[job.frame->assembly->patch_drawable[entry.base_patch]];
  }
  static EntryEffects effects_of(const TileJob& job, const binner::ListEntry& entry);
  // Sets the samples; `lens`: with their points on the lens.
  void prepare_samples(const TileJob& job, IntRect pixels, bool lens);
  // Whether all samples that the entry may touch see a surface nearer than the entry's nearest depth; counts it.
  bool hidden(const binner::ListEntry& entry, TileState& state);
  // The farthest depth of the blocks that the entry may touch.
  float farthest_behind(const binner::ListEntry& entry, TileState& state) const;
  void render_sub_patch(const TileJob& job, const binner::ListEntry& entry, TileState& state);
  // Whether an entry is a cell of a procedure.
  static bool is_cell(const TileJob& job, const binner::ListEntry& entry) {
    return job.procedures != nullptr && job.frame->drawable_of(entry.base_patch).procedure != nullptr;
  }
  // Draws the waiting cells. `begin`: the counts when they began to wait; it moves on.
  void draw_cells(const TileJob& job, TileState& state, timing::SubPatchItem& begin);
  void count_cells(const TileJob& job, std::span<const binner::ListEntry> entries);
  void count_hidden(const TileJob& job, const binner::ListEntry& entry);
  // Tests the mesh of `entry`; samples outside the entry's times are not tested.
  void test_mesh(const TileJob& job, const binner::ListEntry& entry, const MeshStore::Item& item, RayEffects effects,
                 const VisibilitySettings& settings, HitSink& sink);

  MeshStore meshes_;
  MeshVisibility visibility_;
  TileSamples samples_;
  AlphaTest alpha_test_;
  std::vector<HitSink::Hit> masked_hits_;  // of a leaf
  DeferredShader shader_;
  ResolveUnit resolve_;
  SurfaceVelocities velocities_;
  TileStore store_;
  SamplingController sampler_;
  TileResult result_;
  CoreTotals totals_;
  std::vector<TimeRange> leaf_times_;
  bool keep_items_ = false;
  std::uint64_t waiting_bytes_ = 0;  // of layers and a light list, from fill() to light()
  bool list_waits_ = false;
  std::uint64_t image_lookups_ = 0;  // of passes over images, for the current tile
  std::vector<timing::WarpItem> image_warps_;
  bool parameters_ = false;  // SampleLayout::parameters of the current frame
};

}  // namespace tessera::tilecore
