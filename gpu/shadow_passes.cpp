#include "gpu/shadow_passes.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/crc64.h"
#include "base/error.h"
#include "base/random.h"
#include "scene/limits.h"

namespace tessera::gpu {
namespace {

using scene::Capture;
using shaders::Light;

// A spot light may come to need a cube if an animation widens its cone.
bool cone_is_animated(const Capture& capture, int light) {
  const auto moves = [&](const scene::AnimationChannel& channel) {
    return channel.path == scene::AnimatedPath::kOuterCone && channel.object == light;
  };
  return std::ranges::any_of(capture.animations, [&](const scene::Animation& animation) {
    return std::ranges::any_of(animation.channels, moves);
  });
}

int max_layers(const Capture& capture, const scene::ShadowRequest& request) {
  const Light& light = capture.lights[static_cast<std::size_t>(request.light)];
  if (light.type == Light::Type::kDirectional) return request.cascades;
  return scene::needs_cube(light) || cone_is_animated(capture, request.light) ? 6 : 1;
}

// The scene at a time of the shutter, for the maps of that time.
struct Moment {
  double time;
  std::unique_ptr<scene::FrameGeometry> posed;  // nullptr: the frame's own pose
  const scene::FrameGeometry* scene;
};

std::vector<Moment> moments_of(const scene::FrameGeometry& frame, const scene::ShadowSettings& settings) {
  std::vector<Moment> moments;
  for (const double time : shadow_times(frame, settings)) {
    auto posed = scene::pose_moment(frame, time);
    const scene::FrameGeometry* scene = posed.get();
    moments.push_back({time, std::move(posed), scene});
  }
  if (moments.empty()) moments.push_back({0, nullptr, &frame});
  return moments;
}

// The machine and settings of a job, without the features that only colours need.
tilecore::TileJob depth_job(const tilecore::TileJob& view) {
  tilecore::TileJob job;
  job.machine = view.machine, job.core = view.core;
  job.textures = view.textures;
  job.forced = view.forced;
  return job;
}

}  // namespace

ShadowPasses::ShadowPasses(const scene::Assembly& assembly, const frontend::PyramidLibrary& pyramids,
                           const GpuConfiguration& gpu, const RunSettings& settings, Pipeline::Cores cores)
    : gpu_(gpu), pyramids_(pyramids), settings_(settings), pipeline_(gpu, pyramids, std::move(cores)) {
  const Capture& capture = *assembly.capture;
  std::vector<scene::ShadowRequest> requests;
  const int times = capture.played_animations.empty() ? 1 : settings.shadows.times;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    if (capture.nodes[n].light == scene::kNone) continue;
    const auto request = scene::shadow_request(capture, capture.nodes[n].light, settings.effects.shadows);
    if (!request) continue;
    requests.push_back(scene::sized_request(capture, *request, settings.shadows));
    const int layers = max_layers(capture, requests.back());
    slots_.push_back({static_cast<int>(n), layers, std::vector<Slot::Layer>(static_cast<std::size_t>(layers * times))});
  }
  if (slots_.size() > scene::ShadowRequest::kMaxLights)
    throw LimitError(fmt::format("{} lights cast shadows; {} may", slots_.size(), scene::ShadowRequest::kMaxLights));
  scene::MemoryBudget budget(capture.max_bytes, capture.file.string(), assembly.charged_bytes());
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    const auto side = static_cast<std::uint64_t>(requests[k].size);
    budget.charge(side * side * slots_[k].layers.size(), sizeof(float), "depths of the maps of lights");
  }
  maps_.reserve(slots_.size());
  for (std::size_t k = 0; k < slots_.size(); ++k)
    maps_.emplace_back(requests[k].size, static_cast<int>(slots_[k].layers.size()), settings.shadows.format,
                       gpu.tile.width, gpu.tile.height);
}

void ShadowPasses::render(const tilecore::TileJob& view_job, WorkRecorder& recorder, WorkProgress* progress, int number,
                          FrameResult& result, const Shown* shown) {
  shadows_.reset();
  results_.clear();
  slot_of_.clear();
  if (slots_.empty()) return;
  const scene::FrameGeometry& frame = *view_job.frame;
  const StageTimer timer(result, "shadows");
  const std::vector<scene::ShadowLight> lights = shadow_lights(frame, settings_.shadows);
  const std::vector<Moment> moments = moments_of(frame, settings_.shadows);
  views_.clear();
  for (const Moment& moment : moments) views_.push_back(light_views(*moment.scene, lights, settings_.shadows));
  std::vector<tilecore::FrameShadows::Caster> casters;
  binner::TileIndex first_tile = view_job.grid->tile_count();
  Crc64 signature;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const int node = frame.light_nodes[lights[k].light];
    const auto slot = static_cast<std::size_t>(std::ranges::find(slots_, node, &Slot::node) - slots_.begin());
    for (std::size_t m = 0; m < moments.size(); ++m) {
      const int first_layer = static_cast<int>(m) * slots_[slot].layers_at_once;
      for (const scene::LightView& view : views_[m][k]) {
        const Target target{slot, first_layer + view.layer, first_tile};
        render_map(view_job, *moments[m].scene, view, target, recorder, progress, number, shown);
        first_tile += binner::TileGrid(view.size, view.size, gpu_.tile.width, gpu_.tile.height).tile_count();
        if (!gpu_.tile.rendering_elimination) continue;
        Slot::Layer& layer = slots_[slot].layers[static_cast<std::size_t>(target.layer)];
        layer.kept = number;
        // A map whose lists were not whole has unknown content.
        signature.add_value(layer.inputs.of_all_tiles().value_or(hash32(static_cast<std::uint32_t>(number), 0)));
      }
      casters.push_back({lights[k].light, views_[m][k], &maps_[slot], first_layer, moments[m].time});
    }
  }
  signature_ = signature.value();
  if (!casters.empty()) shadows_.emplace(frame, casters, settings_.shadows);
}

void ShadowPasses::render_map(const tilecore::TileJob& view_job, const scene::FrameGeometry& moment,
                              const scene::LightView& view, const Target& target, WorkRecorder& recorder,
                              WorkProgress* progress, int number, const Shown* shown) {
  const std::unique_ptr<scene::FrameGeometry> posed = pose_for_light(moment, view, settings_.shadows);
  const binner::TileGrid grid(view.size, view.size, gpu_.tile.width, gpu_.tile.height);
  const tilecore::SamplePattern pattern({.samples_per_pixel = 1});
  tilecore::DepthMaps& maps = maps_[target.slot];
  maps.begin(target.layer, static_cast<double>(view.camera.camera.near), static_cast<double>(view.camera.camera.far));
  tilecore::TileJob depths = depth_job(view_job);
  depths.frame = posed.get(), depths.grid = &grid, depths.pattern = &pattern;
  depths.depths = &maps, depths.depth_layer = target.layer;
  slot_of_.push_back(target.slot);
  FrameResult& pass = results_.emplace_back(number, tilecore::FrameTargets(IntRect{0, 0, 0, 0}, false));
  const std::string name = fmt::format("shadow {}.{}", target.slot, target.layer);
  ObservedWork record;
  const std::size_t rounds_before = recorder.rounds().size();
  ViewRun run{gpu_, depths, recorder, pass, shown != nullptr ? &record : nullptr, progress};
  run.pass = name;
  Slot::Layer& layer = slots_[target.slot].layers[static_cast<std::size_t>(target.layer)];
  if (gpu_.tile.rendering_elimination) {
    layer.inputs.begin(layer.kept && *layer.kept == number - 1);
    layer.kept.reset();  // a frame that does not finish leaves no state
    run.inputs = &layer.inputs;
  }
  run.first_tile = target.first_tile;
  run.waits = false;
  pipeline_.render(run, {});
  if (shown == nullptr) return;
  record.textures = recorder.take_textures();
  RenderedView map{gpu_, pyramids_, shown->records, shown->heights, depths, record, pass};
  map.rounds = recorder.rounds().subspan(rounds_before);
  map.pass = name;
  map.maps_before = results_.size() - 1;
  map.first_tile = target.first_tile;
  map.map_lines = shown->map_lines;
  shown->observer.map_rendered(map);
}

std::vector<const tilecore::DepthMaps*> ShadowPasses::stored() const {
  std::vector<const tilecore::DepthMaps*> maps;
  for (std::size_t pass = 0; pass < results_.size(); ++pass) {
    const tilecore::ShadowCounters& counted = results_[pass].counters.shadows;
    const tilecore::DepthMaps* of = &maps_[slot_of_[pass]];
    if (counted.texels_stored + counted.tiles_cleared > 0 && (maps.empty() || maps.back() != of)) maps.push_back(of);
  }
  return maps;
}

void ShadowPasses::finish(FrameResult& result) {
  std::vector<PassResult> passes;
  for (FrameResult& pass : results_) {
    result.counters.merge(pass.counters);
    merge(result.drawables, pass.drawables);
    for (PassResult& one : pass.passes) passes.push_back(std::move(one));
  }
  result.passes.insert(result.passes.begin(), std::make_move_iterator(passes.begin()),
                       std::make_move_iterator(passes.end()));
  results_.clear();
}

}  // namespace tessera::gpu
