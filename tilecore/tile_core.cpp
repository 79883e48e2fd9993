#include "tilecore/tile_core.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "base/thread_clock.h"
#include "frontend/sub_patch_effects.h"
#include "tilecore/visibility/clipped_cells.h"
#include "tilecore/visibility/method_choice.h"
#include "tilecore/visibility/tile_frustum.h"

namespace tessera::tilecore {
namespace {

using scene::AlphaMode;

// The nearest opaque surface wins; equal depths go to the lower patch, then the lower triangle, in any order of
// arrival.
class OpaqueSink final : public HitSink {
 public:
  OpaqueSink(std::uint32_t patch, TileState& state) : patch_(patch), state_(state) {}
  void take(std::span<const Hit> hits) override {
    for (const Hit& hit : hits) commit(hit);
  }

 protected:
  void commit(const Hit& hit) {
    const std::size_t s = hit.sample;
    if (hit.z > state_.z[s]) return;
    if (hit.z == state_.z[s] && std::tie(patch_, hit.triangle) >= std::tie(state_.patch[s], state_.triangle[s])) return;
    state_.take_depth(s, hit.z);
    state_.patch[s] = patch_;
    state_.triangle[s] = hit.triangle;
    state_.b1[s] = hit.b1;
    state_.b2[s] = hit.b2;
    state_.rest_x[s] = hit.rest_x;
    state_.rest_y[s] = hit.rest_y;
    state_.positive[s] = hit.positive ? 1 : 0;
    state_.triangles.see(hit.triangle);
  }

  std::uint32_t patch_;
  TileState& state_;
};

// Hits count only where the material's alpha reaches its cutoff. The hits of a leaf are tested together, in the order of
// triangles and samples, so that neither their number nor the lookups depend on the number of lanes.
class MaskSink final : public HitSink {
 public:
  MaskSink(const scene::FrameGeometry& frame, const TileSamples& samples, std::uint32_t patch, TileState& state,
           TextureUnit& textures, AlphaTest& test, std::vector<Hit>& waiting, TileCoreCounters& counters)
      : frame_(frame),
        samples_(samples),
        patch_(patch),
        cutoff_(frame.drawable_of(patch).material->alpha_cutoff),
        opaque_(patch, state),
        textures_(textures),
        test_(test),
        waiting_(waiting),
        counters_(counters) {
    test_.begin(frame, frame.drawable_of(patch));
    waiting_.clear();
  }
  void take(std::span<const Hit> hits) override { waiting_.insert(waiting_.end(), hits.begin(), hits.end()); }
  void leaf_done() override {
    const auto order = [](const Hit& hit) { return std::pair(hit.triangle, hit.sample); };
    if (!std::ranges::is_sorted(waiting_, {}, order)) std::ranges::sort(waiting_, {}, order);
    test(waiting_);
    waiting_.clear();
  }

 private:
  void test(std::span<const Hit> hits) {
    std::array<SurfaceLocation, AlphaTest::kBatch> at;
    std::array<float, AlphaTest::kBatch> alpha;
    for (std::size_t first = 0; first < hits.size(); first += at.size()) {
      const std::span<const Hit> batch = hits.subspan(first, std::min(at.size(), hits.size() - first));
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const float t = time_seen(frame_, patch_, samples_.t(batch[i].sample));
        at[i] = {patch_, batch[i].triangle, batch[i].b1, batch[i].b2, t};
      }
      test_.alphas(std::span(at).first(batch.size()), &textures_, alpha);
      for (std::size_t i = 0; i < batch.size(); ++i)
        if (alpha[i] >= cutoff_) opaque_.take(batch.subspan(i, 1));
    }
    counters_.alpha_tests += hits.size();
    const AlphaTest::Work work = test_.take_work();
    counters_.mask_vertices += work.vertices;
    counters_.mask_vertex_bytes += work.bytes;
  }

  const scene::FrameGeometry& frame_;
  const TileSamples& samples_;
  std::uint32_t patch_;
  float cutoff_;
  OpaqueSink opaque_;
  TextureUnit& textures_;
  AlphaTest& test_;
  std::vector<Hit>& waiting_;
  TileCoreCounters& counters_;
};

class LayerSink final : public HitSink {
 public:
  LayerSink(std::uint32_t patch, TileState& state) : patch_(patch), state_(state) {}
  void take(std::span<const Hit> hits) override {
    for (const Hit& hit : hits)
      if (state_.add_layer({hit.sample, patch_, hit.triangle, hit.z, hit.b1, hit.b2, hit.rest_x, hit.rest_y}))
        state_.triangles.see(hit.triangle);
  }

 private:
  std::uint32_t patch_;
  TileState& state_;
};

HitLimits hit_limits(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  HitLimits limits;
  limits.near = static_cast<float>(frame.projection.near);
  if (frame.projection.far > 0) limits.far = static_cast<float>(frame.projection.far);
  if (!drawable.material->double_sided) {
    // glTF's front faces wind counter-clockwise with y up; raster space has y down, where that is a negative area.
    limits.keep_positive = drawable.mirrored;
    limits.keep_negative = !drawable.mirrored;
  }
  return limits;
}

VisibilitySettings visibility_settings(const TileJob& job, const scene::FrameGeometry& frame,
                                       const scene::PosedDrawable& drawable, const float* depth,
                                       float farthest = std::numeric_limits<float>::infinity()) {
  return {hit_limits(frame, drawable),
          frame.projection.orthographic,
          static_cast<float>(frame.projection.inverse_focus),
          depth,
          frontend::sharp_factor(frame.projection),
          job.kernels,
          farthest,
          weight_steps(job.core.weight_bits)};
}

// Number of boxes of a mesh: one for each leaf and for each cell that is not clipped.
std::uint64_t boxes_of(const MicroMesh& mesh) {
  std::uint64_t boxes = mesh.leaves.size();
  for (const MicroMesh::Leaf& leaf : mesh.leaves) boxes += static_cast<std::uint64_t>(std::popcount(leaf.cells));
  return boxes;
}

VisibilityMethodSettings method_for(const TileJob& job, const MeshStore::Item& item, RayEffects effects,
                                    const TileSamples& samples) {
  if (!job.core.visibility.chooses()) return job.core.visibility;
  return settled(job.core.visibility, item.costs(effects), effects,
                 {samples.spp, static_cast<double>(samples.lens_scale)});
}

// Leaves in a row of the grid that the entry's cells form; clusters are one row.
std::size_t leaf_columns(const scene::FrameGeometry& frame, const binner::ListEntry& entry) {
  const bool grid = frame.drawable_of(entry.base_patch).drawable->kind == scene::Primitive::Kind::kBezierPatches;
  const std::size_t cells = grid ? 4 : kLeafCells;
  return (static_cast<std::size_t>(entry.range.i1 - entry.range.i0) + cells - 1) / cells;
}

// Steps of a merge sorter: each of its ceil(log2 n) stages passes on all n entries.
std::uint64_t sort_steps(std::uint64_t entries) {
  return entries < 2 ? 0 : entries * static_cast<std::uint64_t>(std::bit_width(entries - 1));
}

}  // namespace

void TileCore::keep_items(bool keep) {
  keep_items_ = keep;
  result_.sub_patches.clear();
  shader_.keep_items(keep);
}

TileResult TileCore::take_result() {
  CoreCounters& counters = result_.counters;
  counters.resolve.pixels_shaded += resolve_.take_pixels_shaded();
  counters.stencil = visibility_.take_stencil_counters();
  counters.rays = visibility_.take_ray_counters();
  counters.sampling = sampler_.take_counters();
  counters.shading = shader_.take_counters();
  counters.lights = shader_.take_light_counters();
  tessera::merge(counters.gbuffer, shader_.take_gbuffer_counters());
  result_.light_records = result_.light_records || counters.lights.lists > 0;
  const VelocityBuffer::Work velocities = velocities_.take_work();
  if (const std::uint64_t places = resolve_.take_places() + velocities.places; !parameters_) {
    counters.shading.places_found += places;
    counters.tilecore.triangle_table_bytes += TriangleTable::kRecordBytes * counters.shading.pixel_shader_invocations +
                                              3 * TriangleTable::kCornerBytes * counters.shading.places_found;
  }
  result_.extra_bytes += shader_.take_vertex_bytes();
  counters.texture = shader_.textures().take_counters();
  counters.texture.texels += std::exchange(image_lookups_, 0);
  counters.desampling = resolve_.take_counters();
  counters.desampling.velocity_operations += velocities.operations;
  counters.history = resolve_.take_history_counters();
  tessera::merge(counters.store, store_.take_counters());
  result_.ledger += resolve_.take_ledger();
  result_.patches_read = shader_.take_patches_read();
  result_.texture_misses = shader_.textures().take_misses();
  result_.history_lines = resolve_.take_lines();
  if (keep_items_) {
    result_.warps = shader_.take_warp_items();
    result_.warps.insert(result_.warps.end(), image_warps_.begin(), image_warps_.end());
    image_warps_.clear();
    result_.texture_requests = shader_.textures().take_requests();
  }
  return std::exchange(result_, {});
}

timing::SubPatchItem TileCore::counted() const {
  struct {
    const TileCoreCounters& tilecore;
    const StencilCounters& stencil;
    const SamplingCounters& sampling;
  } const c = {result_.counters.tilecore, visibility_.stencil_counters(), sampler_.counters()};
  timing::SubPatchItem item;
#define TESSERA_ITEM_COUNT(id, count) item[hardware::Event::id] = static_cast<std::uint32_t>(count);
#include "hardware/each_event.inc"
  item.texel_lines = static_cast<std::uint32_t>(shader_.textures().request_count());
  return item;
}

void TileCore::keep_item(const timing::SubPatchItem& before, std::uint32_t drawable) {
  timing::SubPatchItem item = counted();
  for (std::size_t e = 0; e < item.events.size(); ++e) item.events[e] -= before.events[e];
  item.texel_lines -= before.texel_lines;
  item.drawable = drawable;
  result_.sub_patches.push_back(item);
}

TileCore::EntryEffects TileCore::effects_of(const TileJob& job, const binner::ListEntry& entry) {
  using Flag = binner::ListEntry::Flag;
  const scene::FrameGeometry& frame = job.frame->segment(entry.segment);
  const scene::PosedDrawable& drawable = frame.drawable_of(entry.base_patch);
  const auto needs = [&](Flag flag, bool forced) { return (entry.flags & flag) != 0 || forced; };
  EntryEffects effects{
      // A sub-patch of a motion segment exists only at the times of the segment, even if it rests during it.
      {(drawable.moving && needs(Flag::kMoving, false)) || entry.segment != 0 || job.forced.motion,
       (frame.projection.lens_scale != 0 && needs(Flag::kDefocused, false)) || job.forced.lens},
      drawable.material->displacement && drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches &&
          needs(Flag::kDisplaced, job.forced.displacement),
      drawable.material->alpha_mode == AlphaMode::kMask && needs(Flag::kAlphaMask, job.forced.alpha_test)};
  return effects;
}

void TileCore::prepare_samples(const TileJob& job, IntRect pixels, bool lens) {
  if (totals_.drawables.size() < job.frame->drawables.size()) totals_.drawables.resize(job.frame->drawables.size());
  samples_.fill(*job.pattern, pixels, static_cast<float>(job.frame->projection.lens_scale), lens);
}

const scene::FrameGeometry& TileCore::enter(const TileJob& job, const binner::ListEntry& entry) {
  const scene::FrameGeometry& frame = job.frame->segment(entry.segment);
  if (samples_.part != frame.part)
    samples_.enter(*job.pattern, entry.segment, static_cast<float>(frame.projection.lens_scale));
  return frame;
}

// ---- Visibility -------------------------------------------------------------------------------------------------

void TileCore::render_entries(const TileJob& job, binner::TileIndex tile, std::vector<binner::ListEntry> entries,
                              TileState& state) {
  shader_.textures().begin_tile(job.textures);
  const IntRect pixels = job.grid->pixels(tile);
  const auto needs_lens = [&](const binner::ListEntry& entry) { return effects_of(job, entry).ray.lens; };
  prepare_samples(
      job, pixels,
      has_lens(job) && (job.procedures != nullptr || std::any_of(entries.begin(), entries.end(), needs_lens)));
  result_.counters.tilecore.entries_fetched += entries.size();
  for (const binner::ListEntry& entry : entries) ++counts_of(job, entry).entries;
  if (!state.started) {
    state.start(samples_.count, pixels.width(), samples_.spp);
    state.keeps_rest = sees_rest(job);
    state.layout = sample_layout(job);
    state.layout.depth_only = state.layout.depth_only || state.depths_alone;
    parameters_ = state.layout.parameters;
    if (job.spills) spill(job, state);
  }
  if (job.procedures != nullptr) {
    sampler_.count_drawables(totals_.drawables);
    sampler_.begin_tile(samples_);
    count_cells(job, entries);
  }
  result_.counters.tilecore.sort_steps += sort_steps(entries.size());
  std::sort(entries.begin(), entries.end(), [](const binner::ListEntry& a, const binner::ListEntry& b) {
    return std::tie(a.near_depth, a.base_patch, a.segment, a.range.j0, a.range.i0) <
           std::tie(b.near_depth, b.base_patch, b.segment, b.range.j0, b.range.i0);
  });
  // Nearest first: once an entry begins behind everything that the tile sees, so do all that follow. An entry's near
  // depth is no farther than any of its vertices, rounding included; one that begins at the same depth may still win.
  timing::SubPatchItem before = keep_items_ ? counted() : timing::SubPatchItem();
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const binner::ListEntry& entry = entries[e];
    if (job.core.occlusion_culling && entry.near_depth > state.farthest()) {
      result_.counters.tilecore.culled_occlusion += entries.size() - e;
      for (std::size_t rest = e; rest < entries.size(); ++rest) count_hidden(job, entries[rest]);
      break;
    }
    if (job.core.occlusion_culling && hidden(entry, state)) {
      count_hidden(job, entry);
      continue;
    }
    current_work_place().base_patch = entry.base_patch;
    if (is_cell(job, entry)) {
      if (sampler_.take(*job.procedures, ParameterMaps::cell_of(entry.range), {entry.t0, entry.t1}))
        draw_cells(job, state, before);
      continue;
    }
    render_sub_patch(job, entry, state);
    if (keep_items_)
      keep_item(std::exchange(before, counted()), job.frame->assembly->patch_drawable[entry.base_patch] + 1);
  }
  if (job.procedures != nullptr) draw_cells(job, state, before);
  current_work_place().base_patch = -1;
  result_.counters.tilecore.depth_blocks_updated += state.take_depth_updates();
  result_.extra_bytes = std::max(result_.extra_bytes, state.extra_bytes(job.blend_layers()));
  leave_segment(job);
  result_.visibility_misses = shader_.textures().misses().size();
  result_.visibility_texels = shader_.textures().counters().texels;
}

namespace {

// SubPatchItem::drawable of cells that are drawn together.
std::uint32_t drawable_with_most_cells(const TileJob& job, std::span<const SamplingController::CellRead> reads) {
  std::map<std::uint32_t, std::size_t> cells;
  for (const SamplingController::CellRead& read : reads) ++cells[job.procedures->cells()[read.cell].drawable];
  const auto most =
      std::max_element(cells.begin(), cells.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == cells.end() ? 0 : most->first + 1;
}

// TileResult::single_samples of a tile that stores or loads so many samples a pixel.
std::uint64_t single_samples(const IntRect& pixels, int samples) {
  return static_cast<std::uint64_t>(samples - 1) * static_cast<std::uint64_t>(pixels.width()) *
         static_cast<std::uint64_t>(pixels.height());
}

}  // namespace

void TileCore::draw_cells(const TileJob& job, TileState& state, timing::SubPatchItem& before) {
  leave_segment(job);
  sampler_.draw(
      {*job.frame, *job.procedures, samples_, state, &shader_.textures(), &result_.counters.tilecore.alpha_tests});
  std::vector<SamplingController::CellRead> reads = sampler_.take_reads();
  if (reads.empty()) return;
  if (keep_items_) keep_item(std::exchange(before, counted()), drawable_with_most_cells(job, reads));
  result_.cells.push_back({static_cast<std::uint32_t>(result_.tessellations.size()), std::move(reads)});
}

// Cells of a procedure are consecutive in a list, as they were binned.
void TileCore::count_cells(const TileJob& job, std::span<const binner::ListEntry> entries) {
  std::uint64_t cells = 0, objects = 0;
  std::uint32_t last = ~0u;
  for (const binner::ListEntry& entry : entries) {
    if (!is_cell(job, entry)) continue;
    const std::uint32_t drawable = job.frame->assembly->patch_drawable[entry.base_patch];
    ++cells;
    objects += drawable != last ? 1 : 0;
    last = drawable;
  }
  sampler_.count_entries(cells, objects);
}

void TileCore::count_hidden(const TileJob& job, const binner::ListEntry& entry) {
  if (!is_cell(job, entry)) result_.hidden.push_back({entry.base_patch, entry.segment, entry.range});
}

float TileCore::farthest_behind(const binner::ListEntry& entry, TileState& state) const {
  const IntRect& tile = samples_.pixels;
  const IntRect pixels = entry.blocks.pixels(tile);
  return state.farthest({pixels.x0 - tile.x0, pixels.y0 - tile.y0, pixels.x1 - tile.x0, pixels.y1 - tile.y0});
}

bool TileCore::hidden(const binner::ListEntry& entry, TileState& state) {
  ++result_.counters.tilecore.depth_tests;
  const IntRect &tile = samples_.pixels, pixels = entry.blocks.pixels(tile);
  if (state.known_to_hide(entry.near_depth,
                          {pixels.x0 - tile.x0, pixels.y0 - tile.y0, pixels.x1 - tile.x0, pixels.y1 - tile.y0})) {
    ++result_.counters.tilecore.culled_occlusion;
    ++result_.counters.tilecore.culled_blocks;
    return true;
  }
  if (!(entry.near_depth > farthest_behind(entry, state))) return false;
  ++result_.counters.tilecore.culled_occlusion;
  ++result_.counters.tilecore.culled_blocks;
  return true;
}

void TileCore::render_sub_patch(const TileJob& job, const binner::ListEntry& entry, TileState& state) {
  const scene::FrameGeometry& frame = enter(job, entry);
  const scene::PosedDrawable& drawable = frame.drawable_of(entry.base_patch);
  const EntryEffects effects = effects_of(job, entry);
  const MeshStore::Item& item = meshes_.get(frame, entry.base_patch, entry.range, effects.ray, effects.displaced);
  const Tessellator::Work& work = item.work;
  const float lens_scale = effects.ray.lens ? static_cast<float>(frame.projection.lens_scale) : 0.0f;
  result_.tessellations.push_back({{entry.base_patch, entry.segment, entry.range},
                                   static_cast<std::uint32_t>(work.domain_evaluations),
                                   static_cast<std::uint32_t>(work.triangles),
                                   effects.ray.motion,
                                   drawable.deforming || job.frame->drawable_of(entry.base_patch).deforming,
                                   effects.displaced,
                                   effects.ray.lens,
                                   effects.alpha_tested,
                                   drawable.material->alpha_mode == AlphaMode::kBlend,
                                   entry.lists,
                                   item.groups(frame, entry.base_patch, entry.range, lens_scale)});
  ++counts_of(job, entry).sub_patches;
  counts_of(job, entry).triangles += work.triangles;

  const bool rays = effects.ray.motion || effects.ray.lens;
  const VisibilitySettings settings =
      visibility_settings(job, frame, drawable, state.z.data(),
                          rays ? farthest_behind(entry, state) : std::numeric_limits<float>::infinity());
  const auto run = [&](HitSink&& sink) {
    test_mesh(job, entry, item, effects.ray, settings, sink);
    sink.flush();
  };
  switch (drawable.material->alpha_mode) {
    case AlphaMode::kOpaque:
      run(OpaqueSink(entry.base_patch, state));
      break;
    case AlphaMode::kMask:
      if (!effects.alpha_tested)
        run(OpaqueSink(entry.base_patch, state));
      else {
        shader_.reads_patch(entry.base_patch);
        run(MaskSink(frame, samples_, entry.base_patch, state, shader_.textures(), alpha_test_, masked_hits_,
                     result_.counters.tilecore));
      }
      break;
    case AlphaMode::kBlend:
      run(LayerSink(entry.base_patch, state));
      break;
  }
  if (job.pixel_ids) state.seen.add(entry.base_patch, entry.range, state.triangles.seen());
  const std::uint64_t written = state.triangles.end_sub_patch(item.mesh, rays);
  if (!state.layout.parameters && !state.layout.depth_only) result_.counters.tilecore.triangle_table_bytes += written;
}

void TileCore::find_hits(const TileJob& job, const binner::ListEntry& entry, HitSink& sink) {
  const scene::FrameGeometry& frame = enter(job, entry);
  const scene::PosedDrawable& drawable = frame.drawable_of(entry.base_patch);
  const EntryEffects effects = effects_of(job, entry);
  const MeshStore::Item& item = meshes_.get(frame, entry.base_patch, entry.range, effects.ray, effects.displaced);
  test_mesh(job, entry, item, effects.ray, visibility_settings(job, frame, drawable, nullptr), sink);
  sink.flush();
  leave_segment(job);
}

void TileCore::test_mesh(const TileJob& job, const binner::ListEntry& entry, const MeshStore::Item& item,
                         RayEffects effects, const VisibilitySettings& settings, HitSink& sink) {
  const MicroMesh& mesh = item.mesh;
  const scene::FrameGeometry& frame = job.frame->segment(entry.segment);
  const TimeRange entry_times{entry.t0, entry.t1};
  VisibilityWork work;
  if (!kGeneralEffects || (!effects.motion && !effects.lens)) {
    TESSERA_CHECK(!effects.motion && !effects.lens,
                  "a build with TESSERA_EFFECTS=static renders still, pinhole scenes");
    work.boxes_built += boxes_of(mesh);
    raster_mesh(mesh, samples_, settings, sink, work);
  } else if (const VisibilityMethodSettings method = method_for(job, item, effects, samples_); !method.by_class()) {
    visibility_.test({mesh, samples_, entry_times, effects, settings, leaf_columns(frame, entry)}, method, sink, work);
  } else {
    work.boxes_built += boxes_of(mesh);
    leaf_times_.resize(mesh.leaves.size());
    touching_times(mesh.leaves, samples_.pixels, effects.motion, samples_.lens_scale, leaf_times_);
    work.box_tests += mesh.leaves.size();
    work.box_lanes += VisibilityWork::lanes_of(mesh.leaves.size());
    for (TimeRange& times : leaf_times_) times = times.intersect(entry_times);
    trace_leaves(mesh, leaf_times_, samples_, effects, settings, sink, work);
  }
  if (!mesh.clipped_cells.empty())
    test_clipped_cells(mesh, samples_, entry_times, effects, frame.projection, settings, job.core.visibility, sink,
                       work);
  result_.counters.tilecore.boxes_built += work.boxes_built;
  result_.counters.tilecore.box_tests += work.box_tests;
  result_.counters.tilecore.triangle_tests += work.triangle_tests;
  result_.counters.tilecore.box_lanes += work.box_lanes;
  result_.counters.tilecore.triangle_lanes += work.triangle_lanes;
  result_.counters.tilecore.sample_hits += work.sample_hits;
  DrawableCounts& drawable = counts_of(job, entry);
  drawable.box_tests += work.box_tests;
  drawable.triangle_tests += work.triangle_tests;
  drawable.sample_hits += work.sample_hits;
}

void TileCore::store_state(const TileJob& job, const TileState& state) {
  result_.ledger.write(memory::Unit::kTilecore, memory::Purpose::kTileState,
                       memory::burst_bytes(0, state.bytes(job.blend_layers()), job.burst_bytes()));
}

void TileCore::load_state(const TileJob& job, const TileState& state) {
  result_.ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileState,
                      memory::burst_bytes(0, state.bytes(job.blend_layers()), job.burst_bytes()));
}

// ---- Shading ----------------------------------------------------------------------------------------------------

HistoryStorage TileCore::history_storage(const TileJob& job) {
  return {job.burst_bytes(),       job.store.coder,  job.store.compressed,    job.grid->tile_width(),
          job.grid->tile_height(), job.line_bytes(), job.store.signature_bits};
}

void TileCore::begin_resolve(const TileJob& job) {
  if (!job.resolve->keeps_records) return;
  History& next = *job.resolve->next;
  next.cells.resize(HistoryMemory(history_storage(job), job.resolve->settings, next.region).cell_count());
}

bool TileCore::finish_desampled(const TileJob& job, TileState& state, FrameTargets& targets) {
  const double start = thread_seconds();
  resolve_.plan(*job.resolve, *job.frame, samples_, state);
  const double planned = thread_seconds();
  shader_.shade(job, samples_, state, resolve_.pixel_rates());
  double shaded = thread_seconds();
  if (const double checked = shaded; resolve_.check(*job.resolve, shader_.color(), shader_.coverage())) {
    totals_.resolve_seconds += thread_seconds() - checked;
    shader_.shade_again(job, samples_, state, resolve_.reshade_mask());
    shaded = thread_seconds();
  }
  const DeferredShader::Skipped skipped = shader_.take_skipped();
  resolve_.count_skipped(skipped.samples, skipped.invocations);
  const bool open = resolve_.complete(*job.resolve, shader_.color(), shader_.coverage(), history_storage(job), targets);
  totals_.resolve_seconds += (planned - start) + (thread_seconds() - shaded);
  return open;
}

void TileCore::finish_deferred(const TileJob& job, binner::TileIndex tile, FrameTargets& targets) {
  const double start = thread_seconds();
  resolve_.finish_deferred(*job.resolve, job.grid->pixels(tile), history_storage(job), targets);
  totals_.resolve_seconds += thread_seconds() - start;
}

void TileCore::spill(const TileJob& job, const TileState& state) {
  const std::uint64_t needed = samples_.count * state.layout.room_bytes(),
                      room = static_cast<std::uint64_t>(job.machine->cores.memory_bytes);
  if (needed <= room) return;
  const std::uint64_t bytes = memory::burst_bytes(0, needed - room, job.burst_bytes());
  result_.ledger.write(memory::Unit::kTilecore, memory::Purpose::kTileState, bytes);
  result_.ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileState, bytes);
  result_.counters.gbuffer.spilled_bytes += 2 * bytes;
}

std::vector<float> TileCore::prepass_depths(const TileState& state) {
  return {state.z.begin(), state.z.begin() + static_cast<std::ptrdiff_t>(samples_.count)};
}

void TileCore::fill(const TileJob& job, binner::TileIndex tile, TileState& state) {
  TESSERA_CHECK(state.started && samples_.pixels == job.grid->pixels(tile),
                "a tile is filled right after its last entries");
  if (job.procedures != nullptr) sampler_.merge_layers(*job.frame, state);
  shader_.count_drawables(totals_.drawables);
  const std::uint64_t list_bytes = shader_.fill(job, samples_, state);
  list_waits_ = list_bytes > 0;
  // Records of the G-buffer name their triangles; records of layers need the table.
  const std::uint64_t layer_bytes = state.layers.empty() ? 0 : state.extra_bytes(job.blend_layers());
  waiting_bytes_ = memory::burst_bytes(0, layer_bytes + list_bytes, job.burst_bytes());
  result_.ledger.write(memory::Unit::kTilecore, memory::Purpose::kTileState, waiting_bytes_);
  result_.counters.gbuffer.layer_bytes += waiting_bytes_;
}

void TileCore::light(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets) {
  const IntRect pixels = job.grid->pixels(tile);
  TESSERA_CHECK(samples_.pixels == pixels, "a tile is lit right after it was filled");
  shader_.textures().begin_tile(job.textures);
  result_.ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileState, waiting_bytes_);
  result_.counters.gbuffer.layer_bytes += waiting_bytes_;
  result_.extra_bytes = state.extra_bytes(job.blend_layers());
  result_.light_records = list_waits_;
  if (job.spills) spill(job, state);
  shader_.light(job, samples_, state);
  resolve_samples(job, pixels, targets);
  store_colors(job, tile, job.actions, false, targets);
  write_maps(state, targets);
}

void TileCore::finish_depths(const TileJob& job, binner::TileIndex tile, const TileState& state) {
  const IntRect pixels = job.grid->pixels(tile);
  TESSERA_CHECK(state.started && samples_.pixels == pixels && samples_.spp == 1, "a depth pass has a sample a texel");
  const auto texels = static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height());
  result_.stored = job.depths->store(job.depth_layer, pixels, std::span(state.z).first(texels));
  if (!result_.stored) {
    ++result_.counters.shadows.tiles_cleared;
    return;
  }
  result_.counters.shadows.texels_stored += texels;
  result_.ledger.write(memory::Unit::kResolve, memory::Purpose::kShadowMap,
                       memory::burst_bytes(0, texels * job.depths->texel_bytes(), job.burst_bytes()));
}

void TileCore::finish_scene_color(const TileJob& job, binner::TileIndex tile, const TileState& state) {
  const IntRect pixels = job.grid->pixels(tile);
  TESSERA_CHECK(state.started && samples_.pixels == pixels, "a tile is finished right after its last entries");
  shader_.count_drawables(totals_.drawables);
  shader_.shade_opaque(job, samples_, state, *job.scene_color);
  result_.counters.transmission.pixels_kept += static_cast<std::uint64_t>(pixels.width() * pixels.height());
  ++result_.counters.transmission.tiles_again;
}

void TileCore::count_reduced(const TileJob& job, binner::TileIndex tile) {
  for (int level = 1; level < job.scene_color->level_count(); ++level) {
    // A level is made from the texels of the level above; the first from the tile's pixels.
    const IntRect above = reduced_by(*job.scene_color, level - 1, job.grid->pixels(tile));
    result_.counters.transmission.texels_reduced += static_cast<std::uint64_t>(above.width() * above.height());
  }
}

void TileCore::store_coarse_depth(TileState& state, frontend::CoarseDepth& depth) {
  const IntRect& tile = samples_.pixels;
  const IntRect blocks = frontend::CoarseDepth::blocks_of(tile, depth.block_pixels);
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column) {
      const int side = depth.block_pixels;
      const IntRect pixels = IntRect{column * side, row * side, (column + 1) * side, (row + 1) * side}.intersect(tile);
      depth.farthest[depth.blocks.index(column, row)] = frontend::code_not_nearer(
          state.farthest({pixels.x0 - tile.x0, pixels.y0 - tile.y0, pixels.x1 - tile.x0, pixels.y1 - tile.y0}));
    }
  result_.counters.tilecore.depth_blocks_updated += state.take_depth_updates();
}

void TileCore::finish(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets,
                      bool write_scene_color) {
  const IntRect pixels = job.grid->pixels(tile);
  TESSERA_CHECK(state.started && samples_.pixels == pixels, "a tile is finished right after its last entries");
  if (job.procedures != nullptr) sampler_.merge_layers(*job.frame, state);
  shader_.count_drawables(totals_.drawables);
  bool open = false;
  if (job.resolve != nullptr) {
    open = finish_desampled(job, state, targets);
  } else {
    shader_.shade(job, samples_, state, {}, write_scene_color ? job.scene_color : nullptr);
    if (write_scene_color)
      result_.counters.transmission.pixels_kept += static_cast<std::uint64_t>(pixels.width() * pixels.height());
    resolve_samples(job, pixels, targets);
  }
  if (job.velocities != nullptr) write_velocities(job, state);
  store_colors(job, tile, job.actions, open, targets);
  write_maps(state, targets);
  if (!targets.coarse_depth.farthest.empty()) store_coarse_depth(state, targets.coarse_depth);
}

void TileCore::resolve_samples(const TileJob& job, const IntRect& pixels, FrameTargets& targets) {
  if (job.actions.color && job.actions.color->samples > 1) {
    TESSERA_CHECK(job.actions.color->samples == samples_.spp, "an attachment keeps all samples of a pixel");
    const FrameStore* const how = job.store_of(*job.actions.color);
    store_.round(job.actions.color->coder, shader_.color(), shader_.coverage(),
                 how != nullptr && (how->before != nullptr || how->compressed));
    result_.single_samples += single_samples(pixels, samples_.spp);
  }
  resolve_multisample(
      {shader_.color(), shader_.coverage(), samples_.spp, pixels, targets.region, job.burst_bytes(), false},
      targets.color, result_.counters.resolve, result_.ledger);
}

void TileCore::write_velocities(const TileJob& job, TileState& state) {
  const std::uint64_t vertices = velocities_.write(*job.frame, samples_, state, *job.velocities);
  result_.ledger.read(memory::Unit::kResolve, memory::Purpose::kHistory,
                      memory::burst_bytes(0, vertices, job.burst_bytes()));
}

void TileCore::write_maps(TileState& state, FrameTargets& targets) const {
  if (targets.auxiliary) shader_.write_auxiliary(samples_, state, targets);
  if (!targets.ids.values.empty())
    write_pixel_ids(samples_, state, shader_.pixel_invocations(), targets.region, targets.ids);
}

void TileCore::store_colors(const TileJob& job, binner::TileIndex tile, const AttachmentActions& actions, bool open,
                            FrameTargets& targets) {
  TileStore::Tile whole{tile, job.grid->pixels(tile), targets.region, job.burst_bytes(), open};
  if (actions.color) {
    result_.stored = true;
    if (const FrameStore* const how = job.store_of(*actions.color))
      result_.stored = store_.store_attachment(*how, whole, targets.color, result_.ledger).written;
    else if (actions.color->samples == 1)
      store_.round(actions.color->coder, whole, targets.color);
    return;
  }
  if (job.resolve != nullptr) {
    whole.unchanged = &resolve_.unchanged();
    whole.payloads = job.resolve->next->payload.empty() ? nullptr : &job.resolve->next->payload;
  }
  const TileStore::Outcome stored = store_.store(job.store, whole, targets.color, result_.ledger);
  if (stored.changed && job.resolve != nullptr) resolve_.keep_stored(*job.resolve, targets);
  result_.stored = stored.written;
}

void TileCore::load_colors(const TileJob& job, binner::TileIndex tile, const AttachmentActions& actions) {
  if (!actions.load_color) return;
  if (actions.color) return load_attachment(job, tile, *actions.color);
  store_.load(job.store, {tile, job.grid->pixels(tile), job.grid->region(), job.burst_bytes()}, result_.ledger);
}

void TileCore::load_attachment(const TileJob& job, binner::TileIndex tile, const ColorAttachment& attachment) {
  if (const FrameStore* const how = job.store_of(attachment))
    store_.load(*how, {tile, job.grid->pixels(tile), job.grid->region(), job.burst_bytes()}, result_.ledger);
}

void TileCore::copy(const TileJob& job, binner::TileIndex tile, int samples, const AttachmentActions& actions,
                    FrameTargets& targets) {
  result_.single_samples += single_samples(job.grid->pixels(tile), samples);
  load_colors(job, tile, actions);
  store_colors(job, tile, actions, false, targets);
}

void TileCore::run_image_shader(const TileJob& job, std::uint64_t texels, const ImageShader& shader) {
  ImagePassCounters& counters = result_.counters.post;
  const std::uint64_t lanes = job.warp_lanes();
  counters.texels += texels;
  counters.lookups += texels * shader.lookups;
  counters.warps += (texels + lanes - 1) / lanes;
  image_lookups_ += texels * shader.lookups;
  if (!keep_items_) return;
  for (std::uint64_t left = texels; left > 0;) {
    timing::WarpItem& item = image_warps_.emplace_back();
    item.kind = timing::WarpItem::kImage;
    item.lanes = static_cast<std::uint32_t>(std::min(left, lanes));
    item.clocks = shader.clocks, item.registers = shader.registers;
    item.texels = item.lanes * shader.lookups;
    left -= item.lanes;
  }
}

}  // namespace tessera::tilecore
