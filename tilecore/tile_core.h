#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "binner/parameter_buffer.h"
#include "binner/tile_grid.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/drawable_counts.h"
#include "tilecore/frame_targets.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/resolve/resolve_unit.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/shading/deferred_shader.h"
#include "tilecore/shading/transmission.h"
#include "tilecore/tessellation/mesh_store.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/tile_frustum.h"
#include "tilecore/visibility/visibility_method.h"

namespace tessera::tilecore {

struct TileCoreCounters {
  std::uint64_t entries_fetched = 0;
  std::uint64_t sort_steps = 0;
  std::uint64_t culled_occlusion = 0;
  std::uint64_t culled_blocks = 0;
  std::uint64_t depth_tests = 0;
  std::uint64_t depth_blocks_updated = 0;
  std::uint64_t boxes_built = 0;
  std::uint64_t box_tests = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t box_lanes = 0, triangle_lanes = 0;
  std::uint64_t sample_hits = 0;
  std::uint64_t alpha_tests = 0;
};

// All that the units of a core count.
struct CoreCounters {
  TileCoreCounters tilecore;
  StencilCounters stencil;
  RayCounters rays;
  SamplingCounters sampling;
  ShadingCounters shading;
  TextureCounters texture;
  DesamplingCounters desampling;
  HistoryCounters history;
  ResolveCounters resolve;
  CompressionCounters compression;
  StoreCounters store;
  TransmissionCounters transmission;
};

// Calls visit(a's, b's) for each of its counter structs.
template <class A, class B, class Visit>
void for_each_unit(A& a, B& b, const Visit& visit) {
  visit(a.tilecore, b.tilecore);
  visit(a.stencil, b.stencil);
  visit(a.rays, b.rays);
  visit(a.sampling, b.sampling);
  visit(a.shading, b.shading);
  visit(a.texture, b.texture);
  visit(a.desampling, b.desampling);
  visit(a.history, b.history);
  visit(a.resolve, b.resolve);
  visit(a.compression, b.compression);
  visit(a.store, b.store);
  visit(a.transmission, b.transmission);
}
inline void merge(CoreCounters& into, const CoreCounters& from) {
  for_each_unit(into, from, [](auto& to, const auto& of) { tessera::merge(to, of); });
}

// One tile core: renders tile after tile with its own scratch memory. One instance per thread.
//
//   entries of -> order    -> cull what -> tessellate -> moving -> raster or -> visible
//   the tile      by depth    is hidden                  boxes     ray path     samples
//   all entries done -> shade what is visible -> blend -> resolve -> store pixels
class TileCore {
 public:
  // Tests the sub-patches of `entries` against the tile's samples; `state` gathers what they see. May be called several
  // times for one tile (partial renders); the result does not depend on how the entries are divided or ordered.
  void render_entries(const TileJob& job, binner::TileIndex tile, std::vector<binner::QueueEntry> entries,
                      TileState& state);

  // Shades, blends, resolves and writes the pixels of the tile that render_entries was last called for. Returns false
  // where transaction elimination left them unwritten. `keep_behind`: also leaves what is opaque in job.behind.
  bool finish(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets,
              bool keep_behind = false);
  // Instead, of a tile that will be rendered again with what transmits: leaves what is opaque in job.behind.
  void finish_behind(const TileJob& job, binner::TileIndex tile, const TileState& state);
  // Charges the tile for its part of job.behind's smaller levels.
  void count_reduced(const TileJob& job, binner::TileIndex tile);

  // With job.resolve and stencils that reach into neighbouring tiles: fills what was left open. When all tiles are
  // finished.
  void finish_deferred(const TileJob& job, binner::TileIndex tile, FrameTargets& targets);

  // Traffic of storing and loading an unfinished tile.
  void store_state(const TileJob& job, const TileState& state);
  void load_state(const TileJob& job, const TileState& state);

  // Traffic on behalf of this core that another unit counted (its queue's bursts).
  void charge(const memory::Ledger& ledger) { ledger_ += ledger; }

  // All samples that single entries touch, hidden or not, for machines that draw in another order: begin_tile(), then
  // entry by entry in any order. Alpha is not tested, nothing is kept.
  void begin_tile(const TileJob& job, binner::TileIndex tile) {
    prepare_samples(job, job.grid->pixels(tile), has_lens(job));
  }
  void find_hits(const TileJob& job, const binner::QueueEntry& entry, HitSink& sink);

  // Since the last call; the caller adds them up, and passes the requests on to the TessellationCache in emulated
  // order.
  std::vector<TessellationRequest> take_tessellations() { return std::exchange(tessellations_, {}); }
  // Since the last call: what lists named and lay behind all that the tile sees.
  std::vector<SubPatchName> take_hidden() { return std::exchange(hidden_, {}); }
  // Since the last call: cells of procedures that were drawn, those together that were drawn at once.
  struct CellsDrawn {
    std::uint32_t requests_before;  // of take_tessellations()
    std::vector<SamplingController::CellRead> reads;
  };
  std::vector<CellsDrawn> take_cells() { return std::exchange(cells_, {}); }
  // Most bytes of blended layers that a tile kept, since the last call.
  std::uint64_t take_layer_bytes() { return std::exchange(layer_bytes_, 0); }
  // Base patches whose attributes were read since the last call, each once, in order of their numbers.
  std::vector<std::uint32_t> take_patches_read() { return shader_.take_patches_read(); }
  CoreCounters take_counters();
  // By the number of the drawable; as long as the longest list of drawables since the last call.
  std::vector<DrawableCounts> take_drawables() { return std::exchange(drawables_, {}); }
  TextureUnit& textures() { return shader_.textures(); }
  // Lines of what is kept of frames, as ResolveUnit::take_lines().
  std::vector<std::uint32_t> take_history_lines() { return resolve_.take_lines(); }
  // From now on, what units do for each sub-patch and warp is kept. False: no more.
  void keep_items(bool keep) {
    keep_items_ = keep;
    items_.clear();
    shader_.keep_items(keep);
  }
  // Since the last call; what the tessellation cache and shared memories decide is left open.
  std::vector<timing::SubPatchItem> take_sub_patch_items() { return std::exchange(items_, {}); }
  std::vector<timing::WarpItem> take_warp_items() { return shader_.take_warp_items(); }
  // Processor time of the resolve unit, but for the plain multisample resolve.
  double take_resolve_seconds() { return std::exchange(resolve_seconds_, 0.0); }
  memory::Ledger take_ledger();
  // Until take_ledger(), what this core moves also goes to `log`.
  void record_accesses(memory::AccessLog* log) {
    ledger_.record_into(log);
    resolve_.record_accesses(log);
  }

 private:
  static bool has_lens(const TileJob& job) { return job.frame->projection.lens_scale != 0 || job.force_lens; }
  // The frame by which an entry's sub-patch moves; the samples are then those of its segment of motion.
  const scene::FrameGeometry& enter(const TileJob& job, const binner::QueueEntry& entry);
  void leave_segment(const TileJob& job) {
    if (!samples_.part.whole()) samples_.enter(*job.pattern, 0, static_cast<float>(job.frame->projection.lens_scale));
  }
  // Writes the farthest depths of the tile's blocks.
  void store_coarse_depth(TileState& state, frontend::CoarseDepth& depth);
  static HistoryStorage history_storage(const TileJob& job);
  // True: its second pass has pixels left to fill.
  bool finish_desampled(const TileJob& job, TileState& state, FrameTargets& targets);
  // What is counted of items, so far.
  timing::SubPatchItem counted() const;
  // Keeps what was counted since `before` as an item. `drawable`: SubPatchItem::drawable.
  void keep_item(const timing::SubPatchItem& before, std::uint32_t drawable);
  // What the kernels for an entry need: what the scene has and the front end did not rule out, or what is forced.
  struct EntryEffects {
    RayEffects ray;
    bool displaced, alpha_tested;
  };
  DrawableCounts& counts_of(const TileJob& job, const binner::QueueEntry& entry) {
    return drawables_[job.frame->assembly->patch_drawable[entry.base_patch]];
  }
  static EntryEffects effects_of(const TileJob& job, const binner::QueueEntry& entry);
  // `lens`: also through which point of it the samples look.
  void prepare_samples(const TileJob& job, IntRect pixels, bool lens);
  // Whether all samples that the entry may touch see something nearer than it begins; counts it.
  bool hidden(const binner::QueueEntry& entry, TileState& state);
  // The farthest depth of the blocks that it may touch.
  float farthest_behind(const binner::QueueEntry& entry, TileState& state) const;
  void render_sub_patch(const TileJob& job, const binner::QueueEntry& entry, TileState& state);
  // An entry that is a cell of a procedure.
  static bool is_cell(const TileJob& job, const binner::QueueEntry& entry) {
    return job.procedures != nullptr && job.frame->drawable_of(entry.base_patch).procedure != nullptr;
  }
  // `begin`: what was counted when they began to wait for each other; it moves on.
  void draw_cells(const TileJob& job, TileState& state, timing::SubPatchItem& begin);
  void count_cells(const TileJob& job, std::span<const binner::QueueEntry> entries);
  void count_hidden(const TileJob& job, const binner::QueueEntry& entry);
  // Tests the mesh of `entry`; samples outside the entry's times are not tested.
  void test_mesh(const TileJob& job, const binner::QueueEntry& entry, const MeshStore::Item& item, RayEffects effects,
                 const VisibilitySettings& settings, HitSink& sink);

  MeshStore meshes_;
  MeshVisibility visibility_;
  TileSamples samples_;
  DeferredShader shader_;
  ResolveUnit resolve_;
  TileStore store_;
  double resolve_seconds_ = 0;
  std::uint64_t layer_bytes_ = 0;
  SamplingController sampler_;
  TileCoreCounters counters_;
  ResolveCounters resolve_counters_;
  TransmissionCounters transmission_;
  memory::Ledger ledger_;
  std::vector<TessellationRequest> tessellations_;
  std::vector<SubPatchName> hidden_;
  std::vector<CellsDrawn> cells_;
  std::vector<DrawableCounts> drawables_;
  std::vector<TimeRange> leaf_times_;
  bool keep_items_ = false;
  std::vector<timing::SubPatchItem> items_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::TileCoreCounters> = std::to_array<
    CounterField<tilecore::TileCoreCounters>>({
    {"tilecore.entries_fetched", &tilecore::TileCoreCounters::entries_fetched, Combine::kSum, "entries",
     "Entries of tile lists read by tile cores.",
     "MaliFragRdPrim (FRAG_PRIMITIVES_OUT); V3D FEP-valid-primitives-rendered-pixels"},
    {"tilecore.sort_steps", &tilecore::TileCoreCounters::sort_steps, Combine::kSum, "steps",
     "Entries that pass through a stage of the merge sorter that orders a tile's list by nearest depth: n entries "
     "take ceil(log2 n) stages.",
     ""},
    {"tilecore.culled_occlusion", &tilecore::TileCoreCounters::culled_occlusion, Combine::kSum, "entries",
     "Entries dropped before tessellation because every sample of the tile that they may touch sees something "
     "nearer.",
     "MaliFragFPKKillQd; Adreno PERF_LRZ_PRIM_KILLED_BY_LRZ; PowerVR HSR (after rasterisation, there)"},
    {"tilecore.culled_blocks", &tilecore::TileCoreCounters::culled_blocks, Combine::kSum, "entries",
     "Those of tilecore.culled_occlusion that begin nearer than what the tile sees elsewhere: only the blocks of 8x8 "
     "pixels in their records hide them.",
     "Adreno PERF_LRZ_PRIM_KILLED_BY_LRZ"},
    {"tilecore.depth_tests", &tilecore::TileCoreCounters::depth_tests, Combine::kSum, "tests",
     "Entries compared with the farthest depths of the blocks of 8x8 pixels that they may touch; each takes the "
     "time of one such block.",
     ""},
    {"tilecore.depth_blocks_updated", &tilecore::TileCoreCounters::depth_blocks_updated, Combine::kSum, "blocks",
     "Blocks of 8x8 pixels whose farthest depth was found again because a sub-patch came nearer there.",
     "MaliFragFPKBuffer (another unit); V3D: hierarchical depth updates"},
    {"tilecore.boxes_built", &tilecore::TileCoreCounters::boxes_built, Combine::kSum, "boxes",
     "Boxes of leaves and cells, nodes of motion BVHs and bounding polygons that were built, at both motion keys; "
     "those "
     "that several tiles need count once for each.",
     ""},
    {"tilecore.box_tests", &tilecore::TileCoreCounters::box_tests, Combine::kSum, "tests",
     "Samples (ray path) or tiles (raster path) tested against boxes of leaves and cells.", "MaliRTUBox"},
    {"tilecore.triangle_tests", &tilecore::TileCoreCounters::triangle_tests, Combine::kSum, "tests",
     "Samples tested against triangles.", "MaliRTUTri"},
    {"tilecore.box_lanes", &tilecore::TileCoreCounters::box_lanes, Combine::kSum, "lanes",
     "Lanes that box tests took, 16 at a time, idle ones and samples tested against a leaf's own box included.", ""},
    {"tilecore.triangle_lanes", &tilecore::TileCoreCounters::triangle_lanes, Combine::kSum, "lanes",
     "Lanes that triangle tests took, 16 at a time, idle ones included.", ""},
    {"tilecore.sample_hits", &tilecore::TileCoreCounters::sample_hits, Combine::kSum, "samples",
     "Triangle tests whose sample is inside, facing and depth range included.",
     "MaliFragRastQd (times the samples of a quad)"},
    {"tilecore.alpha_tests", &tilecore::TileCoreCounters::alpha_tests, Combine::kSum, "tests",
     "Hits whose alpha was looked up because the material masks.", "MaliFragLZSTestTd"},
});
TESSERA_COUNTERS_COVER(tilecore::TileCoreCounters);

}  // namespace tessera
