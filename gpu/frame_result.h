#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gpu/cost_attribution.h"
#include "gpu/drawable_costs.h"
#include "gpu/effect_report.h"
#include "gpu/frame_counters.h"
#include "gpu/machine_model.h"
#include "gpu/tile_maps.h"
#include "tilecore/frame_targets.h"

namespace tessera::gpu {

// A pass of a view and its counters (docs/timing_model.md, Passes).
struct PassResult {
  std::string name;
  FrameCounters counters;
};

// The right eye's image. The frame's counters include its counters, and the frame's model its cycles and energies.
struct RightEye {
  tilecore::FrameTargets targets;
  FrameCounters counters;
  std::optional<timing::FrameWork> work;  // with output.machine_model
  std::vector<PassResult> passes{};
};

// Results of a device for one frame.
struct FrameResult {
  FrameResult(int number, tilecore::FrameTargets images) : frame(number), targets(std::move(images)) {}

  int frame;
  tilecore::FrameTargets targets;
  FrameCounters counters;
  std::vector<PassResult> passes{};  // of the left or only eye, in the order in which they began
  // Number of the last of these that draw nothing, a round each: `light` of a G-buffer in memory, temporal antialiasing, bloom, copies.
  std::size_t image_passes = 0;
  FrameEffects effects;
  EffectReasons effect_reasons;  // why each effect ran or did not
  FrameEffectPlaces effect_places;
  std::vector<std::string> notes;  // for people: requests that could not be met
  std::optional<RightEye> right;
  // Host time in seconds; tile_threads and resolve_threads: processor time, summed over threads.
  std::map<std::string, double> stage_seconds;
  double seconds = 0;
  std::optional<MachineModel> model;        // with output.machine_model
  std::optional<CostAttribution> shares{};  // of all views, with RenderRequest::attribute
  TileMaps maps{};
  MaterialPlaces materials{};
  DrawableCosts drawables{};
};

// Adds the time since it was made to a stage of a frame.
class StageTimer {
 public:
  StageTimer(FrameResult& result, const char* stage)
      : result_(result), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    result_.stage_seconds[stage_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  FrameResult& result_;
  const char* stage_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace tessera::gpu
