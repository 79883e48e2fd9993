#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "gpu/cost_attribution.h"
#include "gpu/device.h"
#include "gpu/frame_result.h"
#include "gpu/prepared_capture.h"
#include "replay/frame_costs.h"

namespace tessera::replay {

// Leave-one-out: renders and times a frame again without one drawable, one material or one effect, through the same camera
// and after the same frames. The frame then draws the surfaces that the part hid, and skips passes that only the part needed.
// The difference is the cost of the part; its share of the frame's cycles (timing/attribution.h) knows neither.
class LeaveOneOut {
 public:
  // The frame with all of its parts.
  struct MeasuredFrame {
    int frame = 0;
    gpu::CostAttribution shares;
    gpu::FrameEffects effects;
  };

  // `most`: drawables and materials that are left out in turn, those with most cycles first; of effects all that ran.
  // `prepare` is called with each device before it renders the frame, to give it the frames before.
  LeaveOneOut(const scene::Capture& capture, gpu::GpuConfiguration gpu, gpu::RunSettings settings,
              gpu::RenderRequest request, std::size_t most, std::function<void(gpu::Device&)> prepare);

  // A frame's member "without": {"drawables": [{"node", "material", "cycles", "energy_nj", "dram_bytes"}],
  // "materials": [{"material", ...}], "effects": [{"effect", ...}]}: what the frame takes without the part, in the order of
  // the cycles that the frame saves, most first. Ends early where a signal asks for it.
  nlohmann::json measure(const MeasuredFrame& frame, const scene::Assembly& assembly, const DrawableNames& names,
                         bool quiet) const;

  // One effect alone, an EffectCase that is not of the scene's surroundings.
  static bool can_leave_out(const std::string& effect);

 private:
  nlohmann::json takes(int frame, const gpu::CaptureChanges& changes, const gpu::RunSettings& settings,
                       const gpu::GpuConfiguration& gpu) const;

  const scene::Capture& capture_;
  gpu::GpuConfiguration gpu_;
  gpu::RunSettings settings_;
  gpu::RenderRequest request_;
  std::size_t most_;
  std::function<void(gpu::Device&)> prepare_;
};

// What --without says: a number of parts, or all. Throws UsageError.
std::size_t parse_left_out(const std::string& text);

// A table for people: each part's share of the frame's cycles beside what the frame saves without it. `frame`: a frame of
// stats.json with the member "without".
std::string left_out_table(const nlohmann::json& frame);

}  // namespace tessera::replay
