#include "replay/sweep/sweep_runner.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/image_codec.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "gpu/record_file.h"
#include "replay/machine_report.h"
#include "replay/progress.h"
#include "replay/statistics.h"
#include "replay/sweep/capture_library.h"
#include "replay/tile_map_files.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Lets the images of several points into memory as long as they fit.
class ImageMemory {
 public:
  explicit ImageMemory(std::uint64_t max_bytes) : free_(max_bytes), max_(max_bytes) {}
  void take(std::uint64_t bytes) {
    if (bytes > max_)
      throw LimitError(fmt::format("the images of a point need {} bytes, --max-memory allows {}", bytes, max_));
    std::unique_lock lock(mutex_);
    returned_.wait(lock, [&] { return free_ >= bytes; });
    free_ -= bytes;
  }
  void give(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    free_ += bytes;
    returned_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable returned_;
  std::uint64_t free_, max_;
};

class Run {
 public:
  Run(const Study& study, const std::vector<SweepPoint>& points, const SweepFolder& folder, const SweepOptions& options)
      : study_(study),
        points_(points),
        folder_(folder),
        library_(study.captures, options.max_bytes, options.strict, study.variant, study.view, study.size),
        memory_(options.max_bytes) {
    std::set<std::string> asked;
    for (std::size_t p = options.shard; p < points.size(); p += options.shards) {
      ++outcome_.mine;
      if (!asked.insert(points[p].hash).second || folder.read_point(points[p].hash)) {
        ++outcome_.found;
        continue;
      }
      if (folder.has_point(points[p].hash))
        std::fprintf(stderr, "note: %s is damaged; the point is computed again\n",
                     escape_control(folder.point_file(points[p].hash).string()).c_str());
      todo_.push_back(p);
    }
    group_points();
    outcome_.workers =
        std::clamp<std::size_t>(std::min(options.jobs, options.threads), 1, std::max<std::size_t>(groups_.size(), 1));
    threads_each_ = static_cast<int>(std::max<std::size_t>(1, options.threads / outcome_.workers));
    progress_.emplace(todo_.size(), options.quiet || todo_.empty());
  }

  SweepOutcome run() {
    const Clock::time_point start = Clock::now();
    std::vector<std::thread> workers;
    for (std::size_t w = 0; w < outcome_.workers; ++w) workers.emplace_back([this] { work(); });
    for (std::thread& worker : workers) worker.join();
    if (failure_) std::rethrow_exception(failure_);
    outcome_.seconds = seconds_since(start);
    outcome_.load_seconds = library_.load_seconds();
    outcome_.stopped = outcome_.rendered < todo_.size();
    return outcome_;
  }

 private:
  // Points that differ in what times them only, in their order: one of them is rendered, its record is timed for all.
  void group_points() {
    std::map<std::string, std::size_t> group_of;
    for (const std::size_t p : todo_) {
      const SweepPoint& point = points_[p];
      const PointConfiguration configuration = configure_point(study_, point.steps);
      json function = {point.capture, gpu::functional_json(configuration.gpu, configuration.settings)};
      if (configuration.size) function.push_back({configuration.size->width, configuration.size->height});
      // What is no machine has nothing to render.
      if (!point.fault.empty()) function.push_back(point.hash);
      const auto [at, fresh] = group_of.try_emplace(json_text(function), groups_.size());
      if (fresh) groups_.emplace_back();
      groups_[at->second].push_back(p);
    }
  }

  // Each worker's loops run on its own few threads: they never take up another worker's point while they wait.
  void work() {
    tbb::task_arena arena(threads_each_);
    arena.execute([this] {
      try {
        while (!stop_requested() && !failed_) {
          const std::size_t next = next_.fetch_add(1);
          if (next >= groups_.size()) return;
          run_group(groups_[next]);
        }
      } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!failure_) failure_ = std::current_exception();
        failed_ = true;
      }
    });
  }

  // What a rendered point leaves for those that are timed from it.
  struct Rendered {
    json frames;  // null where the values do not fit each other
    std::string fault;
    json head;                                         // of a record, for the names of splits
    std::vector<std::vector<timing::FrameWork>> work;  // by frame and view
  };

  void run_group(const std::vector<std::size_t>& group) {
    Rendered rendered;
    for (const std::size_t p : group) {
      const Clock::time_point start = Clock::now();
      const SweepPoint& point = points_[p];
      double rendering = 0;
      if (p == group.front())
        rendered = run_point(point, !study_.splits.empty() || times_events(group), rendering);
      else if (rendered.fault.empty())
        time_again(group.front(), point, rendered);
      json result = {{"schema", kPointSchema}};
      if (rendered.fault.empty())
        result["frames"] = rendered.frames;
      else
        result["fault"] = rendered.fault;
      write_file_atomically(folder_.point_file(point.hash), json_text(result, 1) + "\n");
      const std::lock_guard lock(mutex_);
      outcome_.render_seconds += rendering;
      ++outcome_.rendered;
      outcome_.timed_again += p == group.front() ? 0 : 1;
      progress_->update(outcome_.rendered,
                        fmt::format("{}: {:.2f} s", point_label(study_, point), seconds_since(start)));
    }
  }

  bool times_events(const std::vector<std::size_t>& group) const {
    return std::any_of(group.begin(), group.end(), [&](std::size_t p) {
      return configure_point(study_, points_[p].steps).gpu.queues.model == hardware::TimingModel::kEvents;
    });
  }

  // `items`: some point of the group is timed by events, or frames are split.
  Rendered run_point(const SweepPoint& point, bool items, double& rendering) {
    if (!point.fault.empty()) return {nullptr, point.fault, nullptr, {}};
    struct Lease {
      CaptureLibrary& library;
      ~Lease() { library.release(); }
    };
    CaptureLibrary::Loaded capture = library_.get(point.capture);
    const Lease lease{library_};
    try {
      return render(point, std::exchange(capture, {}), items, rendering);
    } catch (const UsageError& error) {
      return {nullptr, error.what(), nullptr, {}};
    }
  }

  // Replaces cycles and energies of `rendered`, and their splits, by those of the machine.
  void time_frames(const gpu::GpuConfiguration& gpu, Rendered& rendered) {
    gpu::CachesOfFrames caches;
    for (std::size_t f = 0; f < rendered.work.size(); ++f) {
      if (rendered.work[f].empty()) continue;
      json& frame = rendered.frames[f];
      json splits = json::object();
      gpu::EachView each;
      if (!study_.splits.empty())
        each = [&](const timing::FrameWork& work, const gpu::ViewCost& cost, const timing::WarmCaches& before) {
          for (const Split split : study_.splits)
            splits[std::string(name(split))].push_back(split_rows(split, rendered.head, gpu, work, cost, before));
        };
      const gpu::FrameCost cost =
          gpu::frame_cost(gpu, rendered.work[f], caches.of_frame(gpu, frame["frame"].get<int>()), each);
      frame["timing"] = timing_json(cost.timing);
      frame["energy"] = energy_json(cost.energy);
      frame["area"] = area_json(cost.area);
      if (each) frame["split"] = std::move(splits);
    }
  }

  // What `rendered` holds of point `first` becomes that of another machine; images are the same.
  void time_again(std::size_t first, const SweepPoint& point, Rendered& rendered) {
    time_frames(configure_point(study_, point.steps).gpu, rendered);
    for (const json& frame : rendered.frames) {
      if (!study_.images) return;
      const int number = frame["frame"].get<int>();
      for (const auto& file : {&SweepFolder::image_file, &SweepFolder::tiles_file})
        write_file_atomically((folder_.*file)(point.hash, number),
                              read_whole_text((folder_.*file)(points_[first].hash, number)));
    }
  }

  Rendered render(const SweepPoint& point, const CaptureLibrary::Loaded& capture, bool items, double& seconds) {
    const PointConfiguration configuration = configure_point(study_, point.steps);
    const scene::CaptureSettings& own = capture.capture->settings;
    gpu::RenderRequest request;
    request.width = configuration.size ? configuration.size->width : own.width;
    request.height = configuration.size ? configuration.size->height : own.height;
    request.region = {0, 0, request.width, request.height};
    struct Reserved {
      ImageMemory& memory;
      std::uint64_t bytes;
      ~Reserved() { memory.give(bytes); }
    };
    // Colour and its encoded copies; the baselines render once more.
    const std::uint64_t bytes = static_cast<std::uint64_t>(request.width) * static_cast<std::uint64_t>(request.height) *
                                (study_.baselines ? 64 : 32);
    memory_.take(bytes);
    const Reserved reserved{memory_, bytes};
    request.record_items = items;
    gpu::Device device(capture.prepared, configuration.gpu, configuration.settings, request);
    baselines::BaselineObserver schemes;
    if (study_.baselines) device.set_observer(&schemes);
    const FrameRange range = study_.frames.value_or(FrameRange{own.first_frame, own.first_frame + own.frame_count});
    Rendered out{json::array(), "", nullptr, {}};
    if (!study_.splits.empty())
      out.head = gpu::record_head(study_.capture_names[point.capture], device.assembly(), configuration.gpu,
                                  configuration.settings, request.width, request.height);
    for (int frame = range.first; frame < range.last; ++frame) {
      const Clock::time_point start = Clock::now();
      gpu::FrameResult result = device.render(frame);
      seconds += seconds_since(start);
      out.frames.push_back(frame_json(result, study_.baselines ? &schemes.last() : nullptr));
      std::vector<timing::FrameWork>& work = out.work.emplace_back();
      if (result.model) work.push_back(std::move(result.model->record.work));
      if (result.right && result.right->work) work.push_back(std::move(*result.right->work));
      if (!study_.images) continue;
      const float exposure = configuration.settings.output.exposure > 0
                                 ? static_cast<float>(configuration.settings.output.exposure)
                                 : own.exposure;
      write_png(folder_.image_file(point.hash, frame), shaders::to_display(result.targets.color, exposure));
      write_file_atomically(folder_.tiles_file(point.hash, frame), tile_maps_json(frame, result.maps));
    }
    if (!study_.splits.empty()) time_frames(configuration.gpu, out);
    return out;
  }

  const Study& study_;
  const std::vector<SweepPoint>& points_;
  const SweepFolder& folder_;
  CaptureLibrary library_;
  ImageMemory memory_;
  std::vector<std::size_t> todo_;
  std::vector<std::vector<std::size_t>> groups_;  // of todo_
  int threads_each_ = 1;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;  // of everything below
  std::exception_ptr failure_;
  SweepOutcome outcome_;
  std::optional<Progress> progress_;
};

}  // namespace

SweepOutcome run_sweep(const Study& study, const std::vector<SweepPoint>& points, const SweepFolder& folder,
                       const SweepOptions& options) {
  return Run(study, points, folder, options).run();
}

}  // namespace tessera::replay
