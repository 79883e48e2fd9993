#include "replay/sweep/sweep_runner.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/parallel.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "replay/progress.h"
#include "replay/sweep/rendered_point.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

class Run {
 public:
  Run(const Study& study, const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
      const SweepFolder& folder, const SweepOptions& options, CaptureLibrary& library)
      : study_(study),
        points_(points),
        folder_(folder),
        max_bytes_(options.max_bytes),
        library_(library),
        memory_(options.max_bytes),
        items_(needs_items(study)) {
    WorkLeft left = work_left(points, mine, folder, true);
    outcome_.mine = mine.size();
    outcome_.found = left.found;
    groups_ = std::move(left.groups);
    for (const std::vector<std::size_t>& group : groups_) to_make_ += group.size();
    for (const std::vector<std::size_t>& group : render_groups(points))
      siblings_.emplace(points[group.front()].function, group);
    outcome_.workers =
        std::clamp<std::size_t>(std::min(options.jobs, options.threads), 1, std::max<std::size_t>(groups_.size(), 1));
    threads_each_ = static_cast<int>(std::max<std::size_t>(1, options.threads / outcome_.workers));
    progress_.emplace(to_make_, options.quiet || to_make_ == 0);
  }

  SweepOutcome run() {
    const Stopwatch watch;
    std::vector<std::thread> workers;
    for (std::size_t w = 0; w < outcome_.workers; ++w) workers.emplace_back([this] { work(); });
    for (std::thread& worker : workers) worker.join();
    if (failure_) std::rethrow_exception(failure_);
    std::error_code ignored;
    if (!keeps_record() && fs::exists(folder_.path() / "records", ignored))
      for (const auto& [function, points] : siblings_) remove_record(function);
    outcome_.seconds = watch.seconds();
    outcome_.stopped = outcome_.made < to_make_;
    return outcome_;
  }

 private:
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

  // One point is rendered, or read back as a killed run left it; the others are timed from that.
  void run_group(const std::vector<std::size_t>& group) {
    const std::string& function = points_[group.front()].function;
    std::optional<RenderedPoint> rendered;
    if (has_image_for(function)) rendered = read_render_record(folder_, function, max_bytes_);
    std::size_t next = 0;
    // Values that do not fit each other may do so in the next point, which differs in timing.
    while (!rendered && next < group.size() && !stop_requested()) rendered = render_first(group, next++);
    if (!rendered) return;
    parallel_for(group.size() - next, [&](std::size_t k) {
      if (!stop_requested() && !failed_) time_again(points_[group[next + k]], *rendered);
    });
    if (!keeps_record()) remove_record(function);
  }

  std::optional<RenderedPoint> render_first(const std::vector<std::size_t>& group, std::size_t at) {
    const SweepPoint& point = points_[group[at]];
    const Stopwatch watch;
    if (!point.fault.empty()) {
      finish(point, {{"fault", point.fault}}, watch, &SweepOutcome::refused);
      return std::nullopt;
    }
    const bool records = keeps_record() || others_missing(point);
    double seconds = 0;
    std::optional<RenderedPoint> rendered;
    std::string fault;
    {
      CaptureLibrary::Loaded capture = library_.get(point.capture);
      const CaptureLibrary::Lease lease(library_);
      try {
        rendered =
            render_point({study_, items_, records, &folder_, {}}, point, std::exchange(capture, {}), memory_, seconds);
      } catch (const UsageError& error) {
        fault = error.what();
      }
    }
    if (!rendered) {
      finish(point, {{"fault", fault}}, watch, &SweepOutcome::rendered, seconds);
      return std::nullopt;
    }
    if (records && rendered->has_work()) {
      const std::size_t first = siblings_.at(point.function).front();
      write_render_record(folder_, point.function, configure_point(study_, points_[first].steps).gpu, *rendered);
    }
    finish(point, {{"frames", rendered->frames}}, watch, &SweepOutcome::rendered, seconds);
    return rendered;
  }

  // The results of a render on the point's machine, timed from the record; images are the same.
  void time_again(const SweepPoint& point, const RenderedPoint& rendered) {
    const Stopwatch watch;
    try {
      const json frames = timed_frames(study_, configure_point(study_, point.steps).gpu, rendered);
      if (study_.images) copy_images(point, frames);
      finish(point, {{"frames", frames}}, watch, &SweepOutcome::timed);
    } catch (const UsageError& error) {
      finish(point, {{"fault", error.what()}}, watch, &SweepOutcome::timed);
    }
  }

  void finish(const SweepPoint& point, json result, const Stopwatch& watch, std::size_t SweepOutcome::*counted,
              double rendering = 0) {
    result["schema"] = kPointSchema;
    write_file_atomically(folder_.point_file(point.hash), json_text(result, 1) + "\n");
    const std::lock_guard lock(mutex_);
    outcome_.render_seconds += rendering;
    ++outcome_.made;
    ++(outcome_.*counted);
    progress_->update(outcome_.made, fmt::format("{}: {:.2f} s", point_label(study_, point), watch.seconds()));
  }

  // Whether points of the same function lack results, in this part of the sweep or in another.
  bool others_missing(const SweepPoint& point) const {
    const std::vector<std::size_t>& all = siblings_.at(point.function);
    return std::any_of(all.begin(), all.end(), [&](std::size_t p) {
      return points_[p].hash != point.hash && !folder_.has_point(points_[p].hash);
    });
  }

  // Records of a search wait for points that it has not thought of yet.
  bool keeps_record() const { return study_.records || (study_.searches() && varies_in_timing(study_)); }
  void remove_record(const std::string& function) const {
    const std::vector<std::size_t>& all = siblings_.at(function);
    if (std::any_of(all.begin(), all.end(), [&](std::size_t p) { return !folder_.has_point(points_[p].hash); })) return;
    std::error_code ignored;
    fs::remove(folder_.record_file(function), ignored);
    fs::remove(folder_.record_file(function).parent_path(), ignored);  // where it was the last
  }

  // A point of the function whose images are there; without images none is needed.
  const SweepPoint* with_images(const std::string& function) const {
    std::error_code ignored;
    for (const std::size_t p : siblings_.at(function)) {
      const SweepPoint& point = points_[p];
      if (!folder_.has_point(point.hash)) continue;
      const std::optional<json> result = folder_.read_point(point.hash);
      if (result && result->contains("frames") &&
          std::all_of((*result)["frames"].begin(), (*result)["frames"].end(), [&](const json& frame) {
            const int number = frame["frame"].get<int>();
            return fs::exists(folder_.image_file(point.hash, number), ignored) &&
                   fs::exists(folder_.tiles_file(point.hash, number), ignored);
          }))
        return &point;
    }
    return nullptr;
  }
  bool has_image_for(const std::string& function) const { return !study_.images || with_images(function) != nullptr; }

  void copy_images(const SweepPoint& point, const json& frames) const {
    const SweepPoint* from = with_images(point.function);
    if (from == nullptr) throw SystemError(fmt::format("images in {} are gone", folder_.path().string()));
    for (const json& frame : frames) {
      const int number = frame["frame"].get<int>();
      for (const auto& file : {&SweepFolder::image_file, &SweepFolder::tiles_file})
        write_file_atomically((folder_.*file)(point.hash, number),
                              read_whole_text((folder_.*file)(from->hash, number)));
    }
  }

  const Study& study_;
  const std::vector<SweepPoint>& points_;
  const SweepFolder& folder_;
  std::uint64_t max_bytes_;
  CaptureLibrary& library_;
  ImageMemory memory_;
  bool items_;
  std::size_t to_make_ = 0;
  std::vector<std::vector<std::size_t>> groups_;              // without the points that are there
  std::map<std::string, std::vector<std::size_t>> siblings_;  // all points of each function
  int threads_each_ = 1;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;  // of everything below
  std::exception_ptr failure_;
  SweepOutcome outcome_;
  std::optional<Progress> progress_;
};

}  // namespace

void SweepOutcome::add(const SweepOutcome& more) {
  mine += more.mine, found += more.found, made += more.made;
  rendered += more.rendered, timed += more.timed, refused += more.refused;
  workers = std::max(workers, more.workers);
  seconds += more.seconds, render_seconds += more.render_seconds;
  stopped = stopped || more.stopped;
}

WorkLeft work_left(const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                   const SweepFolder& folder, bool say_damaged) {
  WorkLeft left;
  std::set<std::string> asked;
  std::map<std::string, std::size_t> group_of;
  for (const std::size_t p : mine) {
    const SweepPoint& point = points[p];
    if (!asked.insert(point.hash).second || folder.read_point(point.hash)) {
      ++left.found;
      continue;
    }
    if (say_damaged && folder.has_point(point.hash))
      std::fprintf(stderr, "note: %s is damaged; the point is computed again\n",
                   escape_control(folder.point_file(point.hash).string()).c_str());
    const auto [at, fresh] = group_of.try_emplace(point.function, left.groups.size());
    if (fresh) left.groups.emplace_back();
    left.groups[at->second].push_back(p);
  }
  return left;
}

SweepOutcome run_sweep(const Study& study, const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                       const SweepFolder& folder, const SweepOptions& options, CaptureLibrary& library) {
  return Run(study, points, mine, folder, options, library).run();
}

}  // namespace tessera::replay
