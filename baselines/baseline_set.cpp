#include "baselines/baseline_set.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "base/round_up.h"
#include "baselines/surfaces.h"
#include "baselines/visibility_stream.h"
#include "gpu/pipeline.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::baselines {
namespace {

using memory::Purpose;
using memory::Unit;

// Bytes of the frame, of attachments, of shadow maps and of the image behind surfaces that transmit, which tiles write
// when they are finished.
std::uint64_t stored_bytes(const memory::Ledger& ledger) {
  std::uint64_t bytes = 0;
  for (const Purpose purpose : {Purpose::kFrameBuffer, Purpose::kAttachment, Purpose::kShadowMap, Purpose::kSceneColor})
    bytes += ledger.traffic(Unit::kResolve, purpose).written_bytes;
  return bytes;
}

// Bytes of the frame and of attachments that tiles read before they draw.
std::uint64_t loaded_bytes(const memory::Ledger& ledger) {
  return ledger.traffic(Unit::kTilecore, Purpose::kFrameBuffer).read_bytes +
         ledger.traffic(Unit::kTilecore, Purpose::kAttachment).read_bytes;
}

// Bytes that a pass stores apart from the surfaces that it draws into: the frame and attachments, if they have fewer
// samples, and the image behind surfaces that transmit.
std::uint64_t resolved_bytes(const tilecore::TileJob& job, const memory::Ledger& ledger) {
  const PassSurfaces surfaces = surfaces_of(job);
  const bool into_frame = job.shades() && !job.actions.color;
  const std::uint64_t frame =
      into_frame && surfaces.resolves_color ? ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes : 0;
  const std::uint64_t behind = ledger.traffic(Unit::kResolve, Purpose::kSceneColor).written_bytes;
  if (surfaces.resolved_color_bytes + surfaces.resolved_depth_bytes == 0) return frame + behind;
  // Unless one of them keeps all samples, attachments are stored as tiles store them, compressed and with velocities.
  if (!surfaces.keeps_samples)
    return frame + behind + ledger.traffic(Unit::kResolve, Purpose::kAttachment).written_bytes;
  std::uint64_t pixels = 0;
  for (binner::TileIndex tile = 0; tile < job.grid->tile_count(); ++tile)
    if (job.finishes(tile)) pixels += pixels_of(*job.grid, tile);
  return frame + behind + round_up(pixels * surfaces.resolved_color_bytes, job.burst_bytes()) +
         round_up(pixels * surfaces.resolved_depth_bytes, job.burst_bytes());
}

// The tiles that the pass draws; empty: all.
std::vector<bool> drawn_tiles(const tilecore::TileJob& job) {
  return job.open == nullptr || job.behind ? std::vector<bool>() : *job.open;
}

// The bins that hold a drawn tile; empty: all.
std::vector<bool> drawn_bins(const tilecore::TileJob& job, const binner::TileGrid& bins) {
  if (drawn_tiles(job).empty()) return {};
  std::vector<bool> drawn(bins.tile_count());
  for (binner::TileIndex tile = 0; tile < job.grid->tile_count(); ++tile) {
    if (!job.draws(tile)) continue;
    const IntRect pixels = job.grid->pixels(tile);
    for (binner::TileIndex bin = 0; bin < drawn.size(); ++bin)
      drawn[bin] = drawn[bin] || !bins.pixels(bin).intersect(pixels).empty();
  }
  return drawn;
}

// Joins two passes of the machine without splits that are one of the machine: the bounds of a whole patch reach into the view
// where none of its parts does.
void join(gpu::ObservedWork behind, gpu::ObservedWork& record) {
  for (std::size_t tile = 0; tile < record.entries.size(); ++tile)
    if (record.entries[tile].empty()) record.entries[tile] = std::move(behind.entries[tile]);
  record.tessellations.insert(record.tessellations.begin(), behind.tessellations.begin(), behind.tessellations.end());
}

// Counters of the passes of a run that draw; `first`: number of its first one.
gpu::FrameCounters drawn_counters(const gpu::FrameResult& run, std::size_t first) {
  const std::vector<gpu::PassResult>& passes = run.passes;
  if (first + run.image_passes == 0) return run.counters;
  gpu::FrameCounters counters;
  for (std::size_t k = first; k + run.image_passes < passes.size(); ++k) counters.accumulate(passes[k].counters);
  return counters;
}

}  // namespace

void BaselineSet::accumulate(const BaselineSet& frame) {
  for (std::size_t s = 0; s < schemes.size(); ++s) tessera::accumulate(schemes[s], frame.schemes[s]);
}

BaselineCounters measure_patch_machine(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                                       const gpu::PatchTable& records, const gpu::FrameCounters& counters,
                                       const gpu::ObservedWork& record) {
  const memory::Ledger& ledger = counters.ledger;
  const memory::Traffic state = ledger.traffic(Unit::kTilecore, Purpose::kTileState);
  memory::Traffic all = ledger.total();
  all.read_bytes -= looked_up_bytes(ledger);  // the same for every scheme that shades only visible surfaces
  const std::uint64_t bound_records = ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes,
                      tables = ledger.traffic(Unit::kFrontend, Purpose::kTexture).read_bytes,
                      tables_uncached = counters.frontend.table_lines * job.burst_bytes(),
                      records_kept =
                          (counters.frontend.record_lines - counters.frontend.record_misses) * job.burst_bytes();
  const std::uint64_t tiles = ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes;
  const std::uint64_t shading = ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;
  // Without the caches every request is a tessellation, and every line is read.
  const auto line_bytes = static_cast<std::uint64_t>(gpu.line_bytes());
  std::uint64_t evaluations_uncached = 0, tile_lines_uncached = 0;
  std::vector<gpu::PatchTable::Lines> fetched;
  for (const tilecore::TessellationRequest& r : record.tessellations) {
    evaluations_uncached += r.vertices;
    records.of_tessellation(job.frame->segment(r.segment), r, fetched);
    for (const gpu::PatchTable::Lines& lines : fetched) tile_lines_uncached += lines.end - lines.first;
  }
  const std::uint64_t uncached = (tile_lines_uncached + counters.l2.attribute_requests) * line_bytes;
  BaselineCounters out;
  out.primitives = counters.frontend.sub_patches;
  out.culled_frustum = counters.frontend.culled_frustum;
  out.culled_backface = counters.frontend.culled_backface;
  out.culled_occlusion = counters.tilecore.culled_occlusion;
  out.bounding_operations =
      counters.frontend.bounds_computed + counters.instances.groups_tested + counters.instances.instances_tested;
  out.tile_overlaps = counters.binner.tile_overlaps;
  out.entries = counters.binner.entries;
  out.queue_bytes_written = counters.binner.queue_bytes_written;
  out.queue_bytes_read = counters.binner.queue_bytes_read;
  out.queue_bytes_peak = counters.binner.queue_bytes_peak;
  out.buffer_overflows = counters.binner.partial_renders;
  out.domain_evaluations = evaluations_uncached;
  out.domain_evaluations_cached = counters.tessellation.domain_evaluations;
  out.patch_bytes = bound_records + records_kept + tables_uncached + uncached;
  out.patch_bytes_cached = bound_records + tables + tiles + shading;
  out.frame_bytes_read = state.read_bytes + loaded_bytes(ledger);
  out.frame_bytes_written = state.written_bytes + stored_bytes(ledger);
  out.dram_bytes = all.read_bytes + all.written_bytes;
  out.dram_bytes_uncached = out.dram_bytes - tables - tiles - shading + records_kept + tables_uncached + uncached;
  out.pixel_shader_invocations = counters.shading.pixel_shader_invocations;
  set_pressure(queue_pressure(record, gpu,
                              tile_state_bytes(*job.grid, job.pattern->samples_per_pixel(),
                                               tilecore::sample_layout(job).sample_bytes(), job.burst_bytes())),
               out);
  return out;
}

void measure_triangle_machines(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                               const frontend::PyramidLibrary& pyramids, const gpu::FrameCounters& replay,
                               const gpu::GpuConfiguration& gpu, BaselineSet& out, PrepassDepths* depths,
                               const MachineWork* machine, SchemeWorks* works) {
  const int samples = job.pattern->samples_per_pixel();
  const std::uint64_t sample_bytes = surfaces_of(job).sample_bytes(), loaded = loaded_bytes(replay.ledger);
  const BinSize bin =
      bin_size(job.grid->region(), samples, static_cast<std::uint64_t>(gpu.baselines.gmem_bytes), sample_bytes);
  const binner::TileGrid bins(job.frame->request.width, job.frame->request.height, bin.width, bin.height,
                              job.grid->region());
  const ImmediateFrame drawn = draw_immediately(job, record, gpu, job.depths_alone ? nullptr : depths);
  if (job.depths_alone && depths != nullptr) *depths = drawn.prepass;
  const Pass pass{gpu, job, bins, drawn.depths};
  std::vector<std::pair<std::size_t, std::unique_ptr<Scheme>>> others;
  for (std::size_t s = 0; s < kSchemeCount; ++s)
    if (kSchemes[s].make != nullptr) others.emplace_back(s, kSchemes[s].make());
  for (auto& [s, other] : others) other->begin(pass);
  // Each machine runs on its own: at most as many threads as machines.
  const auto draw = [&](std::span<const DrawnPatch> patches) {
    parallel_for(others.size(), [&](std::size_t r) {
      for (const DrawnPatch& patch : patches) others[r].second->add(patch);
    });
  };
  const scene::Projection& projection = job.frame->projection;
  const GeometryCounts geometry =
      run_geometry(job, pyramids, gpu, TriangleSetup(*job.grid, projection, drawn_tiles(job)),
                   TriangleSetup(bins, projection, drawn_bins(job, bins)), draw);
  const std::vector<std::uint64_t> tile_state = tile_state_bytes(*job.grid, samples, sample_bytes, job.burst_bytes()),
                                   bin_state = tile_state_bytes(bins, samples, sample_bytes, job.burst_bytes());
  std::optional<SchemeWork> work;
  if (machine != nullptr) work.emplace(gpu, job, *machine, geometry, drawn, loaded);
  const DrawnPass whole{geometry,
                        drawn,
                        stored_bytes(replay.ledger) + (job.stores_gbuffer() ? replay.gbuffer.layer_bytes : 0),
                        loaded,
                        resolved_bytes(job, replay.ledger),
                        replay.shading.pixel_shader_invocations,
                        tile_state,
                        bin_state,
                        work ? &*work : nullptr};
  parallel_for(others.size(), [&](std::size_t r) {
    auto& [s, other] = others[r];
    SchemeResult result = other->finish(whole);
    out.schemes[s] = result.counters;
    if (work) (*works)[s] = std::move(result.work);
  });
}

BaselineObserver::WholeRun::WholeRun(const gpu::RenderedView& view, bool items)
    : gpu(patch_whole_machine(view.gpu)), recorder(gpu, view.records, view.heights, false, items, view.map_lines) {}

BaselineObserver::WholeView BaselineObserver::render_whole(const gpu::RenderedView& view, tilecore::TileJob job) {
  std::optional<tilecore::DepthMaps> maps;  // the machine's own stay as they are
  if (job.depths != nullptr) job.depths = &maps.emplace(*job.depths);
  std::optional<tilecore::VelocityAttachment> velocities;
  if (job.velocities != nullptr) job.velocities = &velocities.emplace(*job.velocities);
  WholeView whole{
      gpu::FrameResult(view.result.frame, tilecore::FrameTargets(view.result.targets.region, false)), {}, {}};
  gpu::ViewRun run{whole_->gpu, job, whole_->recorder, whole.result, &whole.record};
  run.pass = view.pass, run.light = view.light;
  if (view.before != nullptr) run.prepass = view.result.passes[view.maps_before].name;
  run.record_before = &whole.before;
  run.first_tile = view.first_tile;
  run.waits = job.depths == nullptr && view.maps_before == 0;
  gpu::StoredArrays arrays;
  if (job.depths == nullptr) {
    arrays.begin(whole_->gpu, job, {}, 0, static_cast<int>(job.attachments.size()), whole.result.frame);
    run.arrays = &arrays;
  }
  gpu::Pipeline(whole_->gpu, view.pyramids).render(run, {});
  // The maps of procedures are made before the pipeline.
  if (job.procedures != nullptr) {
    whole.result.counters.ledger += job.procedures->ledger();
    if (!whole.result.passes.empty()) whole.result.passes.front().counters.ledger += job.procedures->ledger();
  }
  whole_->ledger += whole.result.counters.ledger;
  return whole;
}

void BaselineObserver::begin_frame(const gpu::RenderedView& view) {
  if (view.maps_before > 0) return;
  passes_.clear();
  works_ = {};
  joined_ = {};
  whole_ = std::make_unique<WholeRun>(view, view.gpu.queues.model == hardware::TimingModel::kEvents);
}

void BaselineObserver::measure(const DrawnView& drawn, const tilecore::TileJob& job, const gpu::FrameCounters& whole,
                               const gpu::ObservedWork& whole_record, PrepassDepths* depths) {
  const gpu::RenderedView& view = drawn.view;
  const bool modelled = view.heights != nullptr;
  BaselineSet& set = passes_.emplace_back(PassSet{std::string(drawn.name), {}}).set;
  set[SchemeId::kTessera] = measure_patch_machine(job, view.gpu, view.records, drawn.counters, drawn.record);
  set[SchemeId::kPatchWhole] = measure_patch_machine(job, whole_->gpu, view.records, whole, whole_record);
  if (modelled) {
    set[SchemeId::kTessera].texture_bytes = looked_up_bytes(drawn.counters.ledger);
    set[SchemeId::kPatchWhole].texture_bytes = looked_up_bytes(whole.ledger);
  }
  std::optional<MachineWork> machine;
  if (modelled)
    machine.emplace(
        MachineWork{drawn.rounds, drawn.record.textures, drawn.record.lights, view.heights, view.first_tile});
  SchemeWorks works;
  // Patches that the previous frame's depth hid are in no list of this frame, but an immediate machine draws them.
  const bool hides = view.gpu.frontend.previous_depth_culling && job.depths == nullptr;
  measure_triangle_machines(job, hides ? whole_record : drawn.record, view.pyramids, drawn.counters, view.gpu, set,
                            depths, machine ? &*machine : nullptr, &works);
  if (!modelled) return;
  for (std::size_t s = 0; s < kSchemeCount; ++s)
    if (kSchemes[s].make != nullptr) joined_[s].add(std::move(works[s]), drawn.name, drawn.waits);
}

void BaselineObserver::add_images(std::span<const gpu::PassResult> passes, std::span<const timing::WorkRound> rounds) {
  for (const gpu::PassResult& image : passes)
    passes_.emplace_back(PassSet{image.name, {}}).set.schemes.fill(image_pass_counters(image.counters));
  if (rounds.empty()) return;
  for (std::size_t s = 0; s < kSchemeCount; ++s)
    if (kSchemes[s].make != nullptr) joined_[s].add_images(rounds, passes);
}

void BaselineObserver::measure_before(const gpu::RenderedView& view, const WholeView& whole, tilecore::TileJob& job,
                                      std::span<const timing::WorkRound>& rounds, PrepassDepths& depths) {
  const std::span<const gpu::PassResult> passes = std::span(view.result.passes).subspan(view.maps_before);
  const auto end =
      std::ranges::find_if(rounds, [&](const timing::WorkRound& round) { return round.pass != rounds.front().pass; });
  const auto count = static_cast<std::size_t>(end - rounds.begin());
  tilecore::TileJob drawn = job;
  const bool transmits = !view.before->open.empty();
  if (transmits) {
    job.open = drawn.open = &view.before->open;
    drawn.behind = true;
  } else {
    drawn.depths_alone = true;
    drawn.actions = {};
  }
  measure({view, passes[0].name, passes[0].counters, *view.before, rounds.first(count), view.maps_before == 0}, drawn,
          whole.result.passes.front().counters, whole.before, transmits ? nullptr : &depths);
  rounds = rounds.subspan(count);
  if (!transmits) return;
  const std::size_t reductions = rounds.empty() ? 0 : 1;
  add_images(passes.subspan(1, 1), rounds.first(reductions));
  rounds = rounds.subspan(reductions);
}

void BaselineObserver::set_costs(const gpu::RenderedView& view, const WholeView& whole_view) {
  for (std::size_t s = 0; s < kSchemeCount; ++s)
    if (kSchemes[s].make != nullptr) works_[s] = joined_[s].finish();
  works_[static_cast<std::size_t>(SchemeId::kTessera)] = view.result.model->record.work;
  timing::FrameWork& whole = works_[static_cast<std::size_t>(SchemeId::kPatchWhole)];
  whole = whole_->recorder.finish(whole_->ledger).work;
  const std::size_t images = view.result.image_passes;
  for (std::size_t k = whole_view.result.image_passes; k < images; ++k) {
    whole.passes.push_back(view.result.passes[view.result.passes.size() - images + k].name);
    whole.rounds.push_back(view.rounds[view.rounds.size() - images + k]);
    whole.rounds.back().pass = static_cast<std::uint32_t>(whole.passes.size() - 1);
  }
  parallel_for(kSchemeCount, [&](std::size_t s) {
    const bool unsplit = s == static_cast<std::size_t>(SchemeId::kPatchWhole);
    set_cost(unsplit ? whole_->gpu : view.gpu, works_[s], last_.schemes[s]);
  });
}

void BaselineObserver::map_rendered(const gpu::RenderedView& map) {
  begin_frame(map);
  const WholeView whole = render_whole(map, map.job);
  measure({map, map.pass, map.result.counters, map.record, map.rounds, false}, map.job, whole.result.counters,
          whole.record, nullptr);
}

void BaselineObserver::view_rendered(const gpu::RenderedView& view) {
  begin_frame(view);
  tilecore::TileJob job = view.job;
  job.resolve = nullptr;  // every scheme shades all pixels
  job.pixel_ids = false;
  WholeView whole = render_whole(view, job);
  if (view.before == nullptr && !whole.before.open.empty()) join(std::move(whole.before), whole.record);
  std::span<const timing::WorkRound> rounds = view.rounds;
  if (!rounds.empty()) rounds = rounds.first(rounds.size() - view.result.image_passes);
  PrepassDepths depths;
  const bool before = view.before != nullptr, transmits = before && !view.before->open.empty();
  if (before) measure_before(view, whole, job, rounds, depths);
  const std::size_t earlier = transmits ? 2 : before ? 1 : 0;
  const bool waits = before ? !transmits : view.maps_before == 0;
  measure({view, view.pass, drawn_counters(view.result, view.maps_before + earlier), view.record, rounds, waits}, job,
          drawn_counters(whole.result, earlier), whole.record, before && !transmits ? &depths : nullptr);
  const std::size_t images = view.result.image_passes, lights = whole.result.image_passes, all = passes_.size();
  add_images(std::span(view.result.passes).last(images), view.rounds.last(view.rounds.empty() ? 0 : images));
  // The machine without splits lights its own G-buffer; its run has no other passes over images.
  if (lights > 0) passes_[all].set[SchemeId::kPatchWhole] = image_pass_counters(whole.result.passes.back().counters);
  last_ = {};
  for (const PassSet& pass : passes_)
    for (std::size_t s = 0; s < kSchemeCount; ++s) merge(last_.schemes[s], pass.set.schemes[s]);
  if (view.result.model) set_costs(view, whole);
  whole_.reset();
}

}  // namespace tessera::baselines
