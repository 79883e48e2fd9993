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

// What one render leaves for all points that differ from it in what times them only.
struct RenderedPoint {
  nlohmann::json frames;                             // frame_json() of each, with the model of the machine rendered on
  nlohmann::json head;                               // of a record; null where nobody needs it
  std::vector<std::vector<timing::FrameWork>> work;  // by frame and view; a frame without a model has none

  bool has_work() const { return !work.empty() && !work.front().empty(); }
};

// Lets the images of several points into memory as long as they fit.
class ImageMemory {
 public:
  explicit ImageMemory(std::uint64_t max_bytes) : free_(max_bytes), max_(max_bytes) {}
  // Waits. Throws LimitError for more than there will ever be.
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
  const SweepFolder* images = nullptr;  // where images and tile maps of the study go; null: nowhere
  std::optional<FrameRange> frames{};   // other frames than those of the study
};

// Renders the frames of a point; adds the time inside the machine to `seconds`. Throws UsageError where the values do
// not fit each other, and LimitError.
RenderedPoint render_point(const PointRender& how, const SweepPoint& point, const CaptureLibrary::Loaded& capture,
                           ImageMemory& memory, double& seconds);

// The frames as the machine `gpu` times and splits them: what a render on it gives. Throws UsageError where a shader of
// a frame does not fit the machine.
nlohmann::json timed_frames(const Study& study, const gpu::GpuConfiguration& gpu, const RenderedPoint& rendered);

// Writes SweepFolder::record_file() of a render, and reads it back; nothing where there is none or it is damaged, or
// where it needs more than `max_bytes`. `gpu`: the machine that it names.
void write_render_record(const SweepFolder& folder, const std::string& function, const gpu::GpuConfiguration& gpu,
                         const RenderedPoint& rendered);
std::optional<RenderedPoint> read_render_record(const SweepFolder& folder, const std::string& function,
                                                std::uint64_t max_bytes);

// Wall clock since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace tessera::replay
