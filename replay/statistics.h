#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>

#include "gpu/device.h"
#include "replay/baseline_report.h"
#include "replay/frame_costs.h"
#include "scene/capture.h"

namespace tessera::replay {

// stats.json (schema "tessera.stats/1") and stats.csv of a replay. Counters are raw; ratios belong to reports. A
// counter whose unit did not run is absent, not zero.
class Statistics {
 public:
  Statistics(const scene::Capture& capture, const gpu::GpuConfiguration& gpu, const gpu::RunSettings& settings,
             const gpu::RenderRequest& request);

  // Host time in seconds before the first frame: reading the file, decoding its contents, and assembling base patches.
  // They are the member "host" of stats.json.
  void set_host(double load, double decode, double assemble);

  // Adds a difference between the machine and the requested one; "" adds nothing. The member "gpu_notices".
  void add_gpu_notice(const std::string& notice);
  // Adds a notice about the frames to the notices of the capture; "" adds nothing.
  void add_notice(const std::string& notice);

  // Sets the view of the capture, ViewChoices::json(): the member "view" of "capture", where anything was chosen.
  void set_view(const nlohmann::json& view) {
    if (!view.empty()) head_["capture"]["view"] = view;
  }

  // Records that the replay ended early, for this reason, when so many frames were wanted: the member "stopped".
  void set_stopped(int wanted, const std::string& why) { head_["stopped"] = {{"wanted_frames", wanted}, {"why", why}}; }

  // Upper estimate of the bytes that write() takes on the disk.
  std::uint64_t bytes_at_most() const;

  // Sets the sensitivity of the first frame (sensitivity_json()): the member "sensitivity".
  void set_sensitivity(nlohmann::json sensitivity) { head_["sensitivity"] = std::move(sensitivity); }

  // Sets the first frame's member "without" (LeaveOneOut::measure()).
  void set_without(nlohmann::json without) { frames_.front()["without"] = std::move(without); }
  const nlohmann::json& first_frame() const { return frames_.front(); }

  // `schemes`: the baselines of the same frame, or null. `costs`: members "drawables" and "materials"; null: none.
  void add(const gpu::FrameResult& frame, const baselines::BaselineSet* schemes = nullptr,
           const FrameCosts* costs = nullptr);
  // The passes of the schemes in the frame added last: its member "baseline_passes", where there are several.
  void add_baseline_passes(std::span<const baselines::PassSet> passes);
  std::size_t frame_count() const { return frames_.size(); }

  nlohmann::json json() const;
  std::string csv() const;

  // The other schemes of all frames; without --baselines there are none, and json() has no member "baselines".
  const BaselineReport& baselines() const { return baselines_; }

  // baseline_verdict_text() of all frames.
  std::string verdict() const;

  // Writes both files, and baselines.csv when there are baselines, into `folder`, each whole or not at all.
  void write(const std::filesystem::path& folder) const;

 private:
  nlohmann::json head_;
  hardware::Machine machine_;
  std::vector<nlohmann::json> frames_;
  gpu::FrameCounters total_;
  std::optional<timing::FrameTiming> timing_;
  hardware::FrameEnergy energy_;
  nlohmann::json area_;
  double total_seconds_ = 0;
  std::size_t frame_bytes_ = 0;  // longest text among the measured frames so far
  BaselineReport baselines_;
  bool has_baselines_ = false;
};

// {"unit.event": value, ...} for all counters, and the ledger's sums.
nlohmann::json counters_json(const gpu::FrameCounters& counters);

// A frame's member of "frames" without "host": the part that depends on the inputs alone.
nlohmann::json frame_json(const hardware::Machine& gpu, const gpu::FrameResult& frame,
                          const baselines::BaselineSet* schemes = nullptr);

// Every declared counter for people and programs: name, unit, how it adds up, meaning, vendor names.
nlohmann::json describe_counters();

// The last six lines of a replay: time, whether it meets machine.target_fps, its bound, traffic, energy, and the place
// of the results; figures are means per frame. `statistics`: stats.json, with at least one frame; `results`: the last
// line's text.
std::string replay_summary(const nlohmann::json& statistics, const std::string& results);

}  // namespace tessera::replay
