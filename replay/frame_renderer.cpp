#include "replay/frame_renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/check.h"
#include "base/thread_clock.h"
#include "replay/frame_inputs.h"
#include "replay/resolve_options.h"

namespace tessera::replay {
namespace {

// Adds the time since it was made to a stage.
class StageTimer {
 public:
  StageTimer(FrameResult& result, const char* stage)
      : result_(result), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    result_.stage_seconds[stage_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  FrameResult& result_;
  const char* stage_;
  std::chrono::steady_clock::time_point start_;
};

// Adds the thread's processor time since it was made.
class BusyTimer {
 public:
  explicit BusyTimer(double& seconds) : seconds_(seconds), start_(thread_seconds()) {}
  ~BusyTimer() { seconds_ += thread_seconds() - start_; }

 private:
  double& seconds_;
  double start_;
};

// Calls visit(tile, first_of_group) for every tile: groups on any thread, the tiles of a group one after the other on
// the same, row by row. `first_of_group` is true until a visit clears it.
template <class Visit>
void for_each_tile(const binner::TileGrid& grid, const tilecore::TileJob& job, const Visit& visit) {
  const int side = job.shading == tilecore::ShadingRate::kCache ? job.shading_cache_group : 1;
  const int columns = (grid.columns() + side - 1) / side, rows = (grid.rows() + side - 1) / side;
  parallel_for(static_cast<std::size_t>(columns * rows), [&](std::size_t group) {
    const int x0 = static_cast<int>(group) % columns * side, y0 = static_cast<int>(group) / columns * side;
    bool first_of_group = true;
    for (int y = y0; y < std::min(y0 + side, grid.rows()); ++y)
      for (int x = x0; x < std::min(x0 + side, grid.columns()); ++x)
        visit(std::size_t{grid.index(x, y)}, first_of_group);
  });
}

MachineModel model_machine(const hardware::GpuConfiguration& gpu, FrameRecord record) {
  MachineModel model;
  model.record = std::move(record);
  model.schedule = hardware::schedule_frame(gpu, model.record.work);
  model.timing = hardware::time_frame(gpu, model.record.work, model.schedule);
  model.energy = hardware::frame_energy(gpu, model.record.work, model.timing.cycles);
  return model;
}

}  // namespace

void FrameCounters::accumulate(const FrameCounters& frame) {
  for_each_counter_struct(*this, frame,
                          [](auto& total, const auto& of_frame) { hardware::accumulate(total, of_frame); });
  ledger += frame.ledger;
}

void FrameCounters::merge(const FrameCounters& view) {
  for_each_counter_struct(*this, view, [](auto& into, const auto& of_view) { hardware::merge(into, of_view); });
  ledger += view.ledger;
}

FrameRenderer::FrameRenderer(std::shared_ptr<const PreparedCapture> prepared, const hardware::GpuConfiguration& gpu,
                             const RunSettings& settings, const RenderRequest& request)
    : prepared_(std::move(prepared)),
      capture_(prepared_->capture),
      gpu_(gpu),
      settings_(settings),
      request_(request),
      assembly_(prepared_->assembly),
      pyramids_(prepared_->pyramids),
      texture_memory_(capture_, gpu.line_bytes()),
      displacement_memory_(capture_, gpu.line_bytes(), texture_memory_.lines()),
      camera_(frame_camera(capture_, settings, request.width, request.height)),
      resolve_(resolve_settings(settings, request.width, request.height)) {
  for (const double offset : {0.0, settings.eye_separation}) {
    if (!eyes_.empty() && offset == 0) break;
    eyes_.push_back({camera_, ResolveSequence(resolve_, request.region)});
    eyes_.back().camera.eye_offset = offset;
  }
  if (eyes_.size() > 1) eyes_[0].sequence.serve_other_eye();
}

frontend::FrameRequest FrameRenderer::frame_request(int frame) const {
  return replay::frame_request(capture_, gpu_, settings_, request_.width, request_.height, frame);
}

tilecore::TileJob FrameRenderer::make_job(const frontend::FrameGeometry& frame, const binner::TileGrid& grid,
                                          const tilecore::SamplePattern& pattern) const {
  tilecore::TileJob job;
  job.frame = &frame;
  job.grid = &grid;
  job.pattern = &pattern;
  job.lighting = frame_lighting(capture_);
  const std::optional<Vec3> background = frame_background(capture_);
  job.has_background = background.has_value();
  if (background) job.background = *background;
  using tilecore::ShadingRate;
  job.shading = settings_.shading_rate == "sample"  ? ShadingRate::kSample
                : settings_.shading_rate == "cache" ? ShadingRate::kCache
                                                    : ShadingRate::kPixel;
  if (frame.request.draw_lines) job.shading = ShadingRate::kSample;  // strokes are finer than pixels
  job.shading_cell_pixels = static_cast<float>(settings_.shading_cell_pixels);
  job.shading_cache_entries = static_cast<std::size_t>(gpu_.shading_cache_entries);
  job.shading_cache_group = static_cast<int>(gpu_.shading_cache_group);
  job.blend_layers = static_cast<std::size_t>(gpu_.tilecore_blend_layers);
  job.force_motion = settings_.motion == "on" && tilecore::kGeneralEffects;
  job.force_lens = settings_.defocus == "on" && tilecore::kGeneralEffects;
  job.force_displacement = settings_.displacement == "on";
  job.force_alpha_test = settings_.alpha_test == "on";
  job.cull_occlusion = gpu_.tilecore_occlusion_culling;
  job.visibility = tilecore::visibility_method(gpu_);
  job.burst_bytes = static_cast<std::uint64_t>(gpu_.memory_burst_bytes);
  job.box_bits = static_cast<int>(gpu_.tilecore_box_bits);
  if (settings_.machine_model)
    job.textures = {&texture_memory_, gpu_.texture_cache_bytes, gpu_.texture_cache_ways, gpu_.line_bytes()};
  job.charge_frame_buffer = gpu_.frame_buffer_compression == "none";
  return job;
}

std::unique_ptr<tilecore::ParameterMaps> FrameRenderer::map_procedures(const tilecore::TileJob& job,
                                                                       FrameResult& result) const {
  const auto is_procedure = [](const frontend::PosedDrawable& drawable) { return drawable.procedure != nullptr; };
  if (!job.frame->request.sample_procedures || !job.frame->request.procedures ||
      std::none_of(job.frame->drawables.begin(), job.frame->drawables.end(), is_procedure))
    return nullptr;
  const StageTimer timer(result, "sparse");
  auto maps = std::make_unique<tilecore::ParameterMaps>(
      *job.frame, *job.grid, procedure_settings(settings_),
      tilecore::SamplingController::sub_pixels(job.pattern->samples_per_pixel()), job.burst_bytes);
  hardware::merge(result.counters.sampling, maps->counters());
  result.counters.ledger += maps->ledger();
  return maps;
}

void FrameRenderer::run_tiles(const tilecore::TileJob& job, binner::Binner& binner,
                              std::span<const frontend::BoundedSubPatch> sub_patches, const std::vector<bool>& only,
                              tilecore::TessellationCache& cache, WorkRecorder& recorder, FrameResult& result,
                              MachineRecord* record) {
  const binner::TileIndex tile_count = binner.grid().tile_count();
  std::vector<tilecore::TileState> unfinished;  // filled by partial renders only
  binner::Binner::Cursor cursor;
  std::vector<std::vector<tilecore::TessellationRequest>> tessellations(tile_count);
  if (record != nullptr) record->entries.resize(tile_count);
  bool done = false;
  while (!done) {
    {
      const StageTimer timer(result, "bin");
      binner.buffer().record_accesses(recorder.binner_log());
      done = binner.run(*job.frame, sub_patches, cursor);
      recorder.begin_round(binner);
    }
    const StageTimer timer(result, "tiles");
    if (!done) {
      ++result.counters.binner.partial_renders;
      unfinished.resize(tile_count);
    }
    PerThread<double> busy_seconds;
    for_each_tile(binner.grid(), job, [&](std::size_t t, bool& first_of_group) {
      if (!only.empty() && !only[t]) return;
      const BusyTimer busy(busy_seconds.local());
      const auto tile = static_cast<binner::TileIndex>(t);
      current_work_place() = {result.frame, static_cast<std::int64_t>(t), -1};
      tilecore::TileCore& core = cores_.local();
      TileCounts& work = result.maps.tiles[t];
      hardware::Ledger ledger;
      ledger.record_into(recorder.begin_tile(t, core));
      std::vector<binner::QueueEntry> entries = binner.read_tile(tile, ledger, work.queue_bytes_read);
      core.charge(ledger);
      tilecore::TileState fresh;
      tilecore::TileState& state = unfinished.empty() ? fresh : unfinished[t];
      if (state.started && (done || !entries.empty())) core.load_state(job, state);
      if (done || !entries.empty()) {
        if (record != nullptr) record->entries[t].insert(record->entries[t].end(), entries.begin(), entries.end());
        core.render_entries(job, tile, std::move(entries), state);
        tessellations[t] = core.take_tessellations();
        count_tessellations(tessellations[t], work);
        recorder.begin_shading(t, core);
        if (done)
          core.finish(job, tile, state, result.targets, std::exchange(first_of_group, false));
        else
          core.store_state(job, state);
      }
      count_work(recorder.end_tile(t, job, core, done), work);
    });
    busy_seconds.for_each([&](double seconds) { result.stage_seconds["tile_threads"] += seconds; });
    for (std::size_t t = 0; t < tile_count; ++t) {
      std::vector<tilecore::TessellationRequest>& tile = tessellations[t];
      recorder.share(t, tile, cache);
      if (record != nullptr) record->tessellations.insert(record->tessellations.end(), tile.begin(), tile.end());
      tile.clear();
    }
    recorder.end_round();
    if (!done) binner.reset();
  }
}

frontend::CoarseDepth FrameRenderer::coarse_depth(const tilecore::TileJob& job, const FrameResult& result) const {
  frontend::CoarseDepth depth;
  depth.block_width = static_cast<int>(gpu_.tile_width);
  depth.block_height = static_cast<int>(gpu_.tile_height);
  const IntRect& region = job.grid->region();
  depth.blocks = {region.x0 / depth.block_width, region.y0 / depth.block_height,
                  (region.x1 + depth.block_width - 1) / depth.block_width,
                  (region.y1 + depth.block_height - 1) / depth.block_height};
  depth.farthest = result.targets.tile_farthest;
  depth.projection = job.frame->projection;
  depth.view = job.frame->views[1];
  return depth;
}

void FrameRenderer::render_revived(const tilecore::TileJob& job, binner::Binner& binner,
                                   frontend::FrontEndResult& front_end, tilecore::TessellationCache& cache,
                                   WorkRecorder& recorder, FrameResult& result, MachineRecord* record) {
  if (front_end.aside.empty()) return;
  std::vector<frontend::BoundedSubPatch> revived =
      frontend::revive(*job.frame, pyramids_, gpu_, coarse_depth(job, result), front_end);
  recorder.front_end(*job.frame, front_end);
  if (revived.empty()) return;
  std::vector<bool> again(binner.grid().tile_count(), false);
  for (const frontend::BoundedSubPatch& piece : revived) {
    const IntRect tiles = binner.grid().covered(piece.bounds);
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column) again[binner.grid().index(column, row)] = true;
  }
  // The queues still hold what the tiles were rendered from, unless a partial render emptied them.
  if (result.counters.binner.partial_renders > 0) {
    binner.reset();
    revived.insert(revived.begin(), front_end.sub_patches.begin(), front_end.sub_patches.end());
  }
  run_tiles(job, binner, revived, again, cache, recorder, result, record);
}

void FrameRenderer::collect(const binner::Binner& binner, const tilecore::TessellationCache& cache,
                            WorkRecorder& recorder, FrameResult& result) {
  hardware::merge(result.counters.tessellation, cache.counters());
  result.counters.ledger += cache.ledger();
  hardware::merge(result.counters.binner, binner.buffer().counters());
  for (const TileCounts& work : result.maps.tiles) result.counters.binner.queue_bytes_read += work.queue_bytes_read;
  result.counters.ledger += binner.buffer().ledger();
  cores_.for_each([&](tilecore::TileCore& core) {
    tilecore::merge(result.counters, core.take_counters());
    result.counters.ledger += core.take_ledger();
  });
  const WorkRecorder::Sums sums = recorder.take_sums();
  tilecore::merge(result.counters, sums.core);
  hardware::merge(result.counters.l2, sums.l2);
  result.counters.ledger += sums.ledger;
}

void FrameRenderer::run_machine(const hardware::GpuConfiguration& gpu, const frontend::OcclusionGuess* guess,
                                const tilecore::TileJob& job, WorkRecorder& recorder, FrameResult& result,
                                MachineRecord* record) {
  frontend::FrontEndResult front_end;
  {
    const StageTimer timer(result, "bound");
    front_end = frontend::run_front_end(*job.frame, pyramids_, gpu, guess);
  }
  recorder.front_end(*job.frame, front_end);
  if (job.procedures != nullptr) recorder.sparse_pass(*job.procedures);
  binner::Binner binner(gpu, *job.grid);
  result.targets.tile_farthest.resize(binner.grid().tile_count());
  result.maps = TileMaps(*job.grid);
  tilecore::TessellationCache cache(static_cast<std::uint64_t>(gpu.tessellator_cache_bytes));
  run_tiles(job, binner, front_end.sub_patches, {}, cache, recorder, result, record);
  render_revived(job, binner, front_end, cache, recorder, result, record);
  if (job.resolve != nullptr) finish_deferred(job, binner, recorder, result);
  collect(binner, cache, recorder, result);
  if (!job.charge_frame_buffer) {
    const StageTimer timer(result, "compress");
    tilecore::charge_compressed_frame(result.targets.color, result.targets.region, job.burst_bytes,
                                      result.counters.compression, result.counters.ledger);
  }
  result.counters.frontend = front_end.counters;
  result.counters.ledger += front_end.ledger;
}

BaselineSet FrameRenderer::run_baselines(const tilecore::TileJob& job, const FrameResult& result,
                                         const MachineRecord& record) {
  BaselineSet set;
  set[binner::Scheme::kPreTessellation] = measure_patch_machine(result.counters, record);
  const hardware::GpuConfiguration whole_gpu = patch_whole_machine(gpu_);
  FrameResult whole(result.frame, tilecore::FrameTargets(request_.region, false));
  WorkRecorder whole_work(whole_gpu, nullptr, false);
  MachineRecord whole_record;
  run_machine(whole_gpu, nullptr, job, whole_work, whole, &whole_record);
  set[binner::Scheme::kPatchWhole] = measure_patch_machine(whole.counters, whole_record);
  // What the previous frame's depth hid is in no queue of this one, but an immediate machine draws it.
  const TriangleMachines machines = measure_triangle_machines(
      job, gpu_.frontend_previous_depth_culling ? whole_record : record, result.counters.ledger, gpu_);
  set[binner::Scheme::kPostTessellation] = machines.post_tessellation;
  set[binner::Scheme::kImmediate] = machines.immediate;
  return set;
}

void FrameRenderer::finish_deferred(const tilecore::TileJob& job, const binner::Binner& binner, WorkRecorder& recorder,
                                    FrameResult& result) {
  double resolve = 0;
  if (job.resolve->settings.reach_neighbours) {
    const StageTimer timer(result, "resolve_neighbours");
    recorder.begin_round(binner);
    parallel_for(job.grid->tile_count(), [&](std::size_t t) {
      tilecore::TileCore& core = cores_.local();
      recorder.begin_tile(t, core);
      core.finish_deferred(job, static_cast<binner::TileIndex>(t), result.targets);
      count_work(recorder.end_tile(t, job, core, false), result.maps.tiles[t]);
    });
    recorder.end_round();
  }
  cores_.for_each([&](tilecore::TileCore& core) { resolve += core.take_resolve_seconds(); });
  result.stage_seconds["resolve_threads"] += resolve;
}

void FrameRenderer::measure_error(const tilecore::TileJob& job, FrameResult& result) {
  const StageTimer timer(result, "error");
  tilecore::TileJob plain = job;
  plain.resolve = nullptr;
  FrameResult full(result.frame, tilecore::FrameTargets(request_.region, false));
  WorkRecorder recorder(gpu_, nullptr, false);
  run_machine(gpu_, nullptr, plain, recorder, full, nullptr);
  for (std::size_t pixel = 0; pixel < result.targets.error.values.size(); ++pixel) {
    float& error = result.targets.error.values[pixel];
    for (std::size_t c = 4 * pixel; c < 4 * pixel + 3; ++c)
      error = std::max(error, std::abs(result.targets.color.values[c] - full.targets.color.values[c]));
  }
}

std::unique_ptr<frontend::FrameGeometry> FrameRenderer::render_view(int frame, Eye& eye,
                                                                    const frontend::FrameGeometry* left,
                                                                    FrameResult& result) {
  std::unique_ptr<frontend::FrameGeometry> geometry;
  {
    const StageTimer timer(result, "pose");
    geometry = frontend::pose_frame(assembly_, eye.camera, frame_request(frame));
  }
  const binner::TileGrid grid(request_.width, request_.height, static_cast<int>(gpu_.tile_width),
                              static_cast<int>(gpu_.tile_height), request_.region);
  const tilecore::SamplePattern pattern(sampling_settings(settings_, frame));
  tilecore::TileJob job = make_job(*geometry, grid, pattern);
  const std::unique_ptr<tilecore::ParameterMaps> procedures = map_procedures(job, result);
  job.procedures = procedures.get();
  if (resolve_.desampling != tilecore::Desampling::kOff) {
    const StageTimer timer(result, "motion");
    std::unique_ptr<frontend::FrameGeometry> previous;
    if (eye.sequence.wants_previous_pose(frame))
      previous = frontend::pose_frame(assembly_, eye.camera, frame_request(frame - 1));
    job.resolve = &eye.sequence.begin(frame, *geometry, std::move(previous), result.effect_reasons);
    if (left != nullptr)
      eye.sequence.advect_from_other_eye(*geometry, *left, eyes_[0].sequence.history(),
                                         static_cast<float>(settings_.far_depth));
    job.resolve->all_velocities = resolve_.advection.bfecc;
    job.resolve->auxiliary = request_.resolve_auxiliary;
    result.effects["desampling"] = true;
    if (job.resolve->previous.history != nullptr && tilecore::advects(resolve_) &&
        job.resolve->previous.motion->same_lights())
      result.effects["advection"] = true;
    if (job.resolve->other_eye.history != nullptr) result.effects["advection"] = true;
    result.effects["foveation"] = resolve_.foveation.on && resolve_.desampling == tilecore::Desampling::kAdaptive;
  }
  const bool guesses = gpu_.frontend_previous_depth_culling && left == nullptr;
  std::optional<frontend::OcclusionGuess> guess;
  if (guesses && last_depth_ && last_frame_ == frame - 1)
    guess.emplace(*last_depth_, geometry->projection, geometry->views[0]);
  MachineRecord record;
  const bool baselines = request_.baselines && left == nullptr;
  WorkRecorder recorder(gpu_, settings_.machine_model ? &displacement_memory_ : nullptr, request_.record_accesses);
  run_machine(gpu_, guess ? &*guess : nullptr, job, recorder, result, baselines ? &record : nullptr);
  if (settings_.machine_model) {
    const StageTimer timer(result, "model");
    result.model = model_machine(gpu_, recorder.finish(job, result.counters.ledger));
  }
  if (guesses) {
    last_depth_ = coarse_depth(job, result);
    last_frame_ = frame;
  }
  if (request_.error && job.resolve != nullptr) measure_error(job, result);
  if (baselines) {
    const StageTimer timer(result, "baselines");
    tilecore::TileJob plain = job;
    plain.resolve = nullptr;
    result.baselines = run_baselines(plain, result, record);
  }
  return geometry;
}

FrameResult FrameRenderer::render(int frame) {
  const auto start = std::chrono::steady_clock::now();
  FrameResult result(frame, tilecore::FrameTargets(request_.region, request_.auxiliary, request_.resolve_auxiliary));
  std::unique_ptr<frontend::FrameGeometry> left = render_view(frame, eyes_[0], nullptr, result);
  const bool desampled = resolve_.desampling != tilecore::Desampling::kOff;
  // Before the right eye, which reads the left one's finished frame as its history.
  if (desampled) eyes_[0].sequence.finish();
  if (eyes_.size() > 1) {
    FrameResult right(frame, tilecore::FrameTargets(request_.region, request_.auxiliary, request_.resolve_auxiliary));
    std::unique_ptr<frontend::FrameGeometry> pose = render_view(frame, eyes_[1], left.get(), right);
    if (desampled) {
      eyes_[1].sequence.finish();
      eyes_[1].sequence.keep_pose(std::move(pose));
    }
    for (const auto& [stage, seconds] : right.stage_seconds) result.stage_seconds[stage] += seconds;
    result.counters.merge(right.counters);
    result.maps.add(right.maps);
    if (result.model && right.model) {  // one eye after the other
      result.model->timing.accumulate(right.model->timing);
      result.model->energy.accumulate(right.model->energy);
    }
    result.right = RightEye{std::move(right.targets), right.counters};
  }
  report_effects(
      {*left, settings_, result.counters, result.maps, eyes_.size() > 1, gpu_.frame_buffer_compression != "none"},
      result.effects, result.effect_reasons, result.effect_places);
  if (desampled) eyes_[0].sequence.keep_pose(std::move(left));
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace tessera::replay
