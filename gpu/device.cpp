#include "gpu/device.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/round_up.h"
#include "gpu/shading_paths.h"
#include "gpu/tile_memory.h"
#include "gpu/view_inputs.h"
#include "hardware/external_memory.h"
#include "shaders_cpp/environment_image.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::gpu {
namespace {

// A pose takes half a kilobyte for each drawable. With more drawables than this, a pose is kept only if the next frame
// may well have the same.
constexpr std::size_t kDrawablesToKeep = std::size_t{1} << 16;

// Any pixel of a transmissive surface may show any pixel behind it, so frames must be whole.
constexpr const char* kWholeFrames = "surfaces transmit: any of their pixels may show any pixel behind them";

// The resolve unit's settings; its seed is the seed of the samples. Throws UsageError when they do not fit.
tilecore::ResolveSettings resolve_settings(const RunSettings& settings, bool transmits) {
  tilecore::ResolveSettings resolve = settings.resolve;
  check_resolve(resolve);
  if (transmits) resolve.desampling = tilecore::Desampling::kOff;
  resolve.dither.seed = settings.sampling.seed;
  return resolve;
}

shaders::RadianceImage image_behind(const scene::Assembly& assembly, const RenderRequest& request) {
  if (!transmits(assembly)) return {};
  if (request.region != IntRect{0, 0, request.width, request.height})
    throw UsageError(fmt::format("a region of the frame: {}", kWholeFrames));
  return shaders::RadianceImage(shaders::RadianceImage::mip_chain({request.width, request.height}));
}

// The images that shaders read besides textures.
std::vector<const shaders::RadianceImage*> shader_images(const shaders::RadianceImage& behind,
                                                         const scene::Capture& capture) {
  std::vector<const shaders::RadianceImage*> images{&behind};
  if (capture.environment_image != nullptr) images.push_back(&capture.environment_image->levels());
  return images;
}

GpuConfiguration with_tile_memory(GpuConfiguration gpu, const RunSettings& settings, const scene::Assembly& assembly) {
  check_shading_path(gpu, settings, transmits(assembly));
  grow_tile_memory(gpu, settings);
  return gpu;
}

}  // namespace

Device::Device(std::shared_ptr<const PreparedCapture> prepared, const GpuConfiguration& gpu,
               const RunSettings& settings, const RenderRequest& request)
    : prepared_(std::move(prepared)),
      scene_(prepared_->scene(settings.textures, gpu.geometry)),
      settings_(follow_passes(prepared_->capture, settings)),
      gpu_(with_tile_memory(gpu, settings_, scene_.assembly)),
      request_(request),
      graph_(prepared_->capture, gpu_, settings_, request.region, {request.width, request.height}),
      behind_(image_behind(scene_.assembly, request)),
      cores_(std::make_shared<PerThread<tilecore::TileCore>>()),
      shadow_passes_(scene_.assembly, scene_.pyramids, gpu_, settings_, cores_),
      texture_memory_(scene_.assembly.materials, gpu.line_bytes(), shader_images(behind_, prepared_->capture),
                      shadow_passes_.maps()),
      displacement_memory_(scene_.assembly.materials, gpu.line_bytes(), texture_memory_.lines()),
      patch_table_(scene_.assembly, gpu.line_bytes(), displacement_memory_.end(),
                   tilecore::light_table_bytes(scene_.assembly, settings.shading.light_lists)),
      camera_(request.camera ? frame_camera(*request.camera, settings)
                             : frame_camera(prepared_->capture, settings, request.width, request.height)),
      resolve_(resolve_settings(settings, behind_.level_count() > 0)),
      focus_(resolve_.foveation, prepared_->capture),
      pipeline_(gpu_, scene_.pyramids, cores_) {
  for (const double offset : {0.0, settings.stereo.eye_separation}) {
    if (!eyes_.empty() && offset == 0) break;
    eyes_.push_back({camera_, ResolveSequence(resolve_, request.region)});
    eyes_.back().camera.eye_offset = offset;
  }
  if (eyes_.size() > 1) eyes_[0].sequence.serve_other_eye();
}

std::uint64_t Device::scene_color_bytes() const {
  std::uint64_t bytes = 0;
  for (int level = 0; level < behind_.level_count(); ++level)
    bytes += round_up(static_cast<std::uint64_t>(shaders::RadianceImage::kBlocks.bytes) *
                          static_cast<std::uint64_t>(behind_.width(level)) *
                          static_cast<std::uint64_t>(behind_.height(level)),
                      static_cast<std::uint64_t>(gpu_.memory.burst_bytes));
  return bytes;
}

void Device::set_observer(ViewObserver* observer) {
  if (observer != nullptr && settings_.shading.has_gbuffer() &&
      settings_.shading.layout == tilecore::GbufferLayout::kExact)
    throw UsageError(
        "baselines keep no visibility records, from which the exact G-buffer is lit: to be compared with them set "
        "gbuffer.layout=packed");
  if (observer != nullptr && eliminates(gpu_))
    throw UsageError(
        "baselines render and write every tile; to be compared with them the machine needs "
        "tile.rendering_elimination=false and frame_buffer.transaction_elimination=false");
  if (observer != nullptr && graph_.loads_frame() && frame_store().compressed)
    throw UsageError(
        "baselines do not know how the frame before was compressed; a pass of this capture loads it, so set "
        "frame_buffer.compression=none");
  observer_ = observer;
}

scene::FrameRequest Device::frame_request(int frame) const {
  scene::FrameRequest request =
      gpu::frame_request(prepared_->capture, gpu_, settings_, request_.width, request_.height, frame);
  request.memory_parts = memory_parts_;
  return request;
}

tilecore::FrameStore Device::frame_store() const {
  tilecore::FrameStore store;
  store.coder = tilecore::PixelCoder(gpu_.frame_buffer.format, frame_exposure(prepared_->capture, settings_));
  store.signature_bits = gpu_.frame_buffer.signature_bits;
  store.compressed = gpu_.frame_buffer.compression == tilecore::FrameBufferCompression::kLossless;
  return store;
}

tilecore::TileJob Device::make_job(const scene::FrameGeometry& frame, const binner::TileGrid& grid,
                                   const tilecore::SamplePattern& pattern) {
  tilecore::TileJob job;
  job.frame = &frame;
  job.grid = &grid;
  job.pattern = &pattern;
  job.lighting = frame_lighting(prepared_->capture);
  job.background = frame_background(prepared_->capture);
  job.machine = &gpu_;
  job.core = gpu_.tilecore;
  job.shading_cache = gpu_.shading_cache;
  job.shading = settings_.shading;
  if (frame.request.draw_lines) job.shading.rate = tilecore::ShadingRate::kSample;  // drawn lines are finer than pixels
  const EffectSettings& effects = settings_.effects;
  job.forced = {effects.motion == EffectMode::kOn && tilecore::kGeneralEffects,
                effects.defocus == EffectMode::kOn && tilecore::kGeneralEffects,
                effects.displacement == EffectMode::kOn, effects.alpha_test == EffectMode::kOn};
  if (settings_.output.machine_model)
    job.textures = {&texture_memory_, gpu_.caches.texture_bytes, hardware::Caches::kTextureWays, gpu_.line_bytes()};
  job.store = frame_store();
  job.actions = graph_.actions();
  job.spills = gpu_.tile.fit;
  if (behind_.level_count() > 0) job.lighting.behind = job.scene_color = &behind_;
  return job;
}

void Device::prepare_history(tilecore::History& history, bool whole) const {
  const tilecore::FrameStore store = frame_store();
  const bool rounds = resolve_.colors == tilecore::HistoryColors::kFrameBuffer &&
                      resolve_.desampling == tilecore::Desampling::kAdaptive;
  history.rounded.resize(rounds ? history.color.size() : 0);
  if (whole) {
    if (rounds) store.coder.stored(history.color, history.rounded.data());
    return;
  }
  const std::uint64_t blocks =
      store.compressed ? tilecore::TileStore::header_bytes(store, history.region) / tilecore::kBlockHeaderBytes : 0;
  history.payload.resize(blocks);
}

void Device::set_history(tilecore::History history) {
  prepare_history(history, true);
  eyes_[0].sequence.set_history(std::move(history));
}

std::unique_ptr<tilecore::ParameterMaps> Device::map_procedures(const tilecore::TileJob& job,
                                                                FrameResult& result) const {
  const auto is_procedure = [](const scene::PosedDrawable& drawable) { return drawable.procedure != nullptr; };
  if (!job.frame->request.sample_procedures || !job.frame->request.procedures ||
      std::none_of(job.frame->drawables.begin(), job.frame->drawables.end(), is_procedure))
    return nullptr;
  const StageTimer timer(result, "sparse");
  auto maps = std::make_unique<tilecore::ParameterMaps>(
      *job.frame, job.grid->region(), settings_.procedures,
      tilecore::SamplingController::sub_pixels(job.pattern->samples_per_pixel()), job.burst_bytes());
  tessera::merge(result.counters.sampling, maps->counters());
  result.counters.ledger += maps->ledger();
  return maps;
}

void Device::begin_elimination(int frame, ViewState& eye, tilecore::TileJob& job) const {
  // A frame that does not finish leaves no state for the next.
  const std::optional<int> kept = std::exchange(eye.kept, std::nullopt);
  const bool follows = kept && *kept == frame - 1;
  if (gpu_.frame_buffer.transaction_elimination) {
    if (!follows) eye.stored.forget(job.grid->tile_count(), request_.region);
    job.store.before = &eye.stored;
  }
  if (gpu_.tile.rendering_elimination) eye.inputs.begin(follows);
}

void Device::end_elimination(ViewState& eye, const FrameResult& result) const {
  eye.stored.known = true;
  if (gpu_.tile.rendering_elimination) eye.inputs.finish(result.targets);
  eye.kept = result.frame;
}

void Device::measure_error(const tilecore::TileJob& job, FrameResult& result) {
  const StageTimer timer(result, "error");
  tilecore::TileJob plain = job;
  plain.resolve = nullptr;
  plain.actions = {};
  plain.pixel_ids = false;
  plain.store.payloads = nullptr;
  plain.store.before = nullptr;
  FrameResult full(result.frame, tilecore::FrameTargets(request_.region, false));
  WorkRecorder recorder(gpu_, patch_table_, nullptr, false);
  StoredArrays arrays;
  arrays.begin(gpu_, plain, {}, 0, 0, result.frame);
  ViewRun run{gpu_, plain, recorder, full, nullptr};
  run.arrays = &arrays;
  pipeline_.render(run, {});
  for (std::size_t pixel = 0; pixel < result.targets.error.values.size(); ++pixel) {
    float& error = result.targets.error.values[pixel];
    for (std::size_t c = 4 * pixel; c < 4 * pixel + 3; ++c)
      error = std::max(error, std::abs(result.targets.color.values[c] - full.targets.color.values[c]));
  }
}

tilecore::ResolveFrame& Device::begin_resolve(int frame, ViewState& eye, const scene::FrameGeometry& geometry,
                                              const scene::FrameGeometry* left, FrameResult& result) {
  const StageTimer timer(result, "motion");
  std::shared_ptr<const scene::FrameGeometry> previous;
  if (eye.sequence.wants_previous_pose(frame))
    previous = scene::pose_frame(scene_.assembly, eye.camera, frame_request(frame - 1));
  const scene::FrameRequest& request = geometry.request;
  const DVec2 focus =
      focus_.at(0.5 * (request.open_time + request.close_time), eye.camera, request.width, request.height);
  tilecore::ResolveFrame& resolve =
      eye.sequence.begin(frame, geometry, std::move(previous), focus, result.effect_reasons);
  if (left != nullptr)
    eye.sequence.advect_from_other_eye(geometry, *left, eyes_[0].sequence.history(),
                                       static_cast<float>(settings_.stereo.far_depth));
  prepare_history(*resolve.next, false);
  // Signatures of whole tiles need all colours of the tiles.
  resolve.keeps_blocks = resolve_.skip_unchanged && tilecore::reads_blocks(resolve_) &&
                         resolve_.colors == tilecore::HistoryColors::kFrameBuffer &&
                         !gpu_.frame_buffer.transaction_elimination;
  resolve.auxiliary = request_.resolve_auxiliary;
  result.effects["desampling"] = true;
  if (resolve.previous.history != nullptr && tilecore::advects(resolve_) &&
      !resolve.previous.motion->lights().everywhere())
    result.effects["advection"] = true;
  if (resolve.other_eye.history != nullptr) result.effects["advection"] = true;
  result.effects["foveation"] = resolve_.foveation.on() && resolve_.desampling == tilecore::Desampling::kAdaptive;
  return resolve;
}

std::shared_ptr<const scene::FrameGeometry> Device::pose_view(int frame, ViewState& eye, bool notes,
                                                              FrameResult& result) const {
  const StageTimer timer(result, "pose");
  std::shared_ptr<const scene::FrameGeometry> geometry =
      scene::pose_frame(scene_.assembly, eye.camera, frame_request(frame), std::exchange(eye.pose, nullptr));
  if (geometry->request.motion_segments == 0 && geometry->motion_error > geometry->request.motion_error && notes)
    result.notes.push_back(fmt::format(
        "frame {}: with {} motion segments a point may be {:.1f} pixels off its curve; "
        "sampling.motion_error asks for {} (sampling.motion_segments_max may be up to {})",
        frame, geometry->segments.size(), geometry->motion_error, geometry->request.motion_error, kMaxMotionSegments));
  if (geometry->drawables.size() <= kDrawablesToKeep || !geometry->any_motion) eye.pose = geometry;
  return geometry;
}

void Device::model_view(int frame, WorkRecorder& recorder, FrameResult& result) {
  const StageTimer timer(result, "model");
  timing::WarmCaches* const caches = caches_.of_frame(gpu_, frame);
  const timing::WarmCaches before = request_.attribute && caches != nullptr ? *caches : timing::WarmCaches();
  result.model = model_machine(gpu_, recorder.finish(result.counters.ledger), caches, request_.keep_transactions);
  if (request_.attribute) {
    const MachineModel& model = *result.model;
    result.shares = attribute_costs(gpu_, model.record.work, model.schedule, model.timing, model.energy,
                                    recorder.take_traffic(), before);
  }
}

std::shared_ptr<const scene::FrameGeometry> Device::render_view(int frame, ViewState& eye,
                                                                const scene::FrameGeometry* left, FrameResult& result) {
  std::shared_ptr<const scene::FrameGeometry> geometry = pose_view(frame, eye, left == nullptr, result);
  const binner::TileGrid grid(request_.width, request_.height, gpu_.tile.width, gpu_.tile.height, request_.region);
  tilecore::SamplingSettings sampling =
      sampling_settings(settings_.sampling, gpu_.tilecore.visibility, frame, geometry->parts());
  const Taa* const taa = graph_.taa();
  if (taa != nullptr) {
    const std::array<float, 2> jitter = taa_jitter(frame);
    sampling.jitter_x = jitter[0], sampling.jitter_y = jitter[1];
  }
  const tilecore::SamplePattern pattern(sampling);
  tilecore::TileJob job = make_job(*geometry, grid, pattern);
  if (taa != nullptr) {
    const StageTimer timer(result, "motion");
    job.velocities = &eye.taa.begin(frame, *geometry, request_.region);
  }
  job.pixel_ids = request_.pixel_ids;
  const std::unique_ptr<tilecore::ParameterMaps> procedures = map_procedures(job, result);
  job.procedures = procedures.get();
  if (resolve_.desampling != tilecore::Desampling::kOff)
    job.resolve = &begin_resolve(frame, eye, *geometry, left, result);
  else if (settings_.resolve.desampling != tilecore::Desampling::kOff)
    result.effect_reasons["desampling"] = kWholeFrames;
  const bool guesses = gpu_.frontend.previous_depth_culling && left == nullptr && job.scene_color == nullptr;
  std::optional<frontend::CoarseDepth> guess;
  if (guesses && last_depth_ && last_frame_ == frame - 1)
    guess = frontend::reproject(*last_depth_, geometry->projection, geometry->views[0]);
  ObservedWork record, before;
  const bool observed = observer_ != nullptr && left == nullptr;
  const DisplacementMemory* const heights = settings_.output.machine_model ? &displacement_memory_ : nullptr;
  const memory::LineRange map_lines{static_cast<std::uint32_t>(texture_memory_.first_map_line()),
                                    static_cast<std::uint32_t>(texture_memory_.lines())};
  WorkRecorder recorder(
      gpu_, patch_table_, heights, request_.record_accesses,
      request_.record_items || request_.attribute || gpu_.queues.model == hardware::TimingModel::kEvents, map_lines);
  std::optional<ShadowPasses::Shown> shown;
  if (observed) shown.emplace(ShadowPasses::Shown{*observer_, patch_table_, heights, map_lines});
  shadow_passes_.render(job, recorder, &progress_, frame, result, shown ? &*shown : nullptr);
  const std::size_t map_rounds = recorder.rounds().size(), map_count = shadow_passes_.count();
  job.lighting.shadows = shadow_passes_.shadows();
  job.maps_signature = shadow_passes_.signature();
  if (eliminates(gpu_)) begin_elimination(frame, eye, job);
  if (graph_.loads_frame() && job.store.compressed) {
    eye.payloads.resize(tilecore::TileStore::header_bytes(job.store, request_.region) / tilecore::kBlockHeaderBytes);
    job.store.payloads = &eye.payloads;
  }
  job.attachments = eye.attachments.begin(gpu_, graph_.attachments(), grid, frame);
  ViewRun run{gpu_,
              job,
              recorder,
              result,
              observed ? &record : nullptr,
              &progress_,
              gpu_.tile.rendering_elimination ? &eye.inputs : nullptr};
  run.pass = graph_.name(), run.prepass = graph_.prepass_name(), run.light = graph_.light_name();
  run.copies = graph_.copies();
  run.taa = taa;
  run.taa_history = &eye.taa;
  run.bloom = graph_.bloom();
  eye.arrays.begin(gpu_, job, {taa, graph_.bloom()}, graph_.attachment_bytes(),
                   static_cast<int>(job.attachments.size()), frame);
  run.arrays = &eye.arrays;
  run.bloom_strength = static_cast<float>(settings_.post.bloom);
  run.waits = !shadow_passes_.any_pass();
  if (observed) run.record_before = &before;
  pipeline_.render(run, {guesses, guess ? &*guess : nullptr});
  for (const tilecore::DepthMaps* maps : shadow_passes_.stored()) recorder.stored(texture_memory_.range(*maps));
  shadow_passes_.finish(result);
  if (result.counters.transmission.pixels_kept > 0) recorder.stored(texture_memory_.range(behind_));
  if (record.textures.empty()) record.textures = recorder.take_textures();
  if (settings_.output.machine_model) model_view(frame, recorder, result);
  if (eliminates(gpu_)) end_elimination(eye, result);
  eye.attachments.end(frame);
  eye.arrays.end(frame);
  if (guesses) {
    last_depth_ = std::exchange(result.targets.coarse_depth, {});
    last_frame_ = frame;
  }
  if (request_.error && job.resolve != nullptr) measure_error(job, result);
  if (observed) {
    const StageTimer timer(result, "observe");
    RenderedView view{gpu_, scene_.pyramids, patch_table_, heights, job, record, result};
    if (result.model) view.rounds = std::span(result.model->record.work.rounds).subspan(map_rounds);
    view.pass = graph_.name(), view.light = graph_.light_name();
    if (settings_.shading.path == tilecore::ShadingPath::kPrepass || !before.open.empty()) view.before = &before;
    view.maps_before = map_count;
    view.map_lines = map_lines;
    observer_->view_rendered(view);
  }
  if (taa != nullptr) eye.taa.end(geometry);  // observers still read the motion from the previous frame
  return geometry;
}

void Device::render_right_eye(int frame, const scene::FrameGeometry& left, FrameResult& result) {
  FrameResult right(frame, tilecore::FrameTargets(request_.region, request_.auxiliary, request_.resolve_auxiliary,
                                                  request_.pixel_ids));
  ResolveSequence& sequence = eyes_[1].sequence;
  std::shared_ptr<const scene::FrameGeometry> pose = render_view(frame, eyes_[1], &left, right);
  if (resolve_.desampling != tilecore::Desampling::kOff) {
    sequence.finish();
    sequence.keep_pose(std::move(pose));
  }
  for (const auto& [stage, seconds] : right.stage_seconds) result.stage_seconds[stage] += seconds;
  result.counters.merge(right.counters);
  result.maps.add(right.maps);
  result.materials.add(right.materials);
  merge(result.drawables, right.drawables);
  if (result.shares && right.shares) result.shares->add(*right.shares);
  if (result.model && right.model) {  // one eye after the other
    const double clocks = result.model->timing.cycles / gpu_.clock_mhz * hardware::external_memory(gpu_).clock_mhz();
    for (const memory::Burst& transaction : right.model->transactions)
      result.model->transactions.push_back(
          {transaction.cycle + static_cast<std::uint64_t>(std::ceil(clocks)), transaction.address, transaction.write});
    result.model->timing.accumulate(right.model->timing);
    result.model->energy.accumulate(right.model->energy);
  }
  result.right = RightEye{std::move(right.targets), right.counters, {}, std::move(right.passes)};
  if (right.model) result.right->work = std::move(right.model->record.work);
}

FrameResult Device::render(int frame) {
  const auto start = std::chrono::steady_clock::now();
  FrameResult result(frame, tilecore::FrameTargets(request_.region, request_.auxiliary, request_.resolve_auxiliary,
                                                   request_.pixel_ids));
  std::shared_ptr<const scene::FrameGeometry> left = render_view(frame, eyes_[0], nullptr, result);
  const bool desampled = resolve_.desampling != tilecore::Desampling::kOff;
  // Before the right eye, which reads the left one's finished frame as its history.
  if (desampled) eyes_[0].sequence.finish();
  if (eyes_.size() > 1) render_right_eye(frame, *left, result);
  report_effects(
      {*left, settings_, result.counters, result.maps, result.materials, prepared_->capture.environment_image.get(),
       eyes_.size() > 1, gpu_.frame_buffer.compression != tilecore::FrameBufferCompression::kNone},
      result.effects, result.effect_reasons, result.effect_places);
  if (desampled) eyes_[0].sequence.keep_pose(std::move(left));
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace tessera::gpu
