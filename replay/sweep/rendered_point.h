#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/configuration.h"
#include "replay/sweep/capture_library.h"
#include "replay/sweep/points.h"
#include "replay/sweep/study.h"
#include "replay/sweep/sweep_folder.h"
#include "timing/work.h"

namespace tessera::replay {

// Results of one render, for all points that differ from it in timing keys only.
struct RenderedPoint {
  nlohmann::json frames;  // frame_json() of each, with the model of the machine that rendered it
  nlohmann::json head;    // head of a record; null where no record is needed
  std::vector<std::vector<timing::FrameWork>> work;  // by frame and view; a frame without a model has none

  bool has_work() const { return !work.empty() && !work.front().empty(); }
};

// Admits the images of several points into memory as long as they fit.
class ImageMemory {
 public:
  explicit ImageMemory(std::uint64_t max_bytes) : free_(max_bytes), max_(max_bytes) {}
  // Waits for the memory. Throws LimitError for more than the maximum.
  void take(std::uint64_t bytes);
  void give(std::uint64_t bytes);

 private:
  std::mutex mutex_;
  std::condition_variable returned_;
  std::uint64_t free_, max_;
};

// How a point is rendered.
struct PointRender {
  const Study& study;
  bool items = false;                   // needs_items(study)
  bool head = false;                    // a record will be written
  const SweepFolder* images = nullptr;  // folder for the study's images and tile maps; null: they are not written
  std::optional<FrameRange> frames{};   // frames in place of the study's
};

// Renders the frames of a point; adds the time inside the machine to `seconds`. Throws UsageError where the values do
// not fit each other, and LimitError.
RenderedPoint render_point(const PointRender& how, const SweepPoint& point, const CaptureLibrary::Loaded& capture,
                           ImageMemory& memory, double& seconds);

// The frames as the machine `gpu` times and splits them, equal to a render on it. Throws UsageError where a shader of a
// frame does not fit the machine.
nlohmann::json timed_frames(const Study& study, const gpu::GpuConfiguration& gpu, const RenderedPoint& rendered);

// Write SweepFolder::record_file() of a render, and read it back; reading returns nothing where it is missing or
// damaged, or needs more than `max_bytes`. `gpu`: the machine that the record names.
void write_render_record(const SweepFolder& folder, const std::string& function, const gpu::GpuConfiguration& gpu,
                         const RenderedPoint& rendered);
std::optional<RenderedPoint> read_render_record(const SweepFolder& folder, const std::string& function,
                                                std::uint64_t max_bytes);

// Wall clock since construction.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace tessera::replay
