#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

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

  // Parts to leave out in turn: up to `most` drawables and `most` materials, the ones with most cycles first, and all
  // effects that ran; or drawables alone, or a single drawable.
  struct Wanted {
    std::size_t most = std::numeric_limits<std::size_t>::max();
    bool drawables_only = false;
    std::optional<DrawableName> only{};
  };
  // Callbacks that follow a measurement; any of them may be empty.
  struct Watch {
    std::function<bool()> stop{};                 // asked before each part; true ends the measurement
    std::function<void(gpu::Device*)> renders{};  // the device that renders, which may be abandoned; then nullptr
    // Results so far, numbers of measured parts and of all parts, and the names of the last part.
    std::function<void(const nlohmann::json& so_far, std::size_t done, std::size_t all, const nlohmann::json& last)>
        measured{};
  };

  // `prepare` is called with each device before it renders the frame, to render the previous frames.
  LeaveOneOut(const scene::Capture& capture, gpu::GpuConfiguration gpu, gpu::RunSettings settings,
              gpu::RenderRequest request, Wanted wanted, std::function<void(gpu::Device&)> prepare);

  // Returns a frame's member "without": {"drawables": [{"node", "material", "cycles", "energy_nj", "dram_bytes"}],
  // "materials": [{"material", ...}], "effects": [{"effect", ...}]}. The figures are costs of the frame without the
  // part; rows are sorted by the cycles that the frame saves, most first. Kinds that are not wanted are missing. Throws
  // gpu::Abandoned if the current device was abandoned.
  nlohmann::json measure(const MeasuredFrame& frame, const scene::Assembly& assembly, const DrawableNames& names,
                         const Watch& watch) const;

  // Whether an effect can be left out alone: it is an EffectCase outside of the scene's surroundings.
  static bool can_leave_out(const std::string& effect);

 private:
  struct Part;
  std::vector<std::pair<const char*, std::vector<Part>>> kinds_of(const MeasuredFrame& frame,
                                                                  const scene::Assembly& assembly,
                                                                  const DrawableNames& names) const;
  nlohmann::json takes(int frame, const Part& part, const Watch& watch) const;

  const scene::Capture& capture_;
  gpu::GpuConfiguration gpu_;
  gpu::RunSettings settings_;
  gpu::RenderRequest request_;
  Wanted wanted_;
  std::function<void(gpu::Device&)> prepare_;
};

// Parses the value of --without: a number of parts, or "all". Throws UsageError.
std::size_t parse_left_out(const std::string& text);

// Prints each measured part on standard error, and ends the measurement on a signal.
LeaveOneOut::Watch watch_on_terminal(bool quiet);

// A table for people: each part's share of the frame's cycles, and the cycles that the frame saves without it. `frame`:
// a frame of stats.json with the member "without".
std::string left_out_table(const nlohmann::json& frame);

}  // namespace tessera::replay
