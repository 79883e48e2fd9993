#include "replay/sweep/sweep_estimate.h"

#include <algorithm>
#include <map>
#include <optional>

#include "base/error.h"
#include "base/parallel.h"
#include "replay/sweep/rendered_point.h"

namespace tessera::replay {
namespace {

class Estimator {
 public:
  Estimator(const Study& study, const std::vector<SweepPoint>& points, const SweepOptions& options,
            CaptureLibrary& library)
      : study_(study), points_(points), options_(options), library_(library) {}

  SweepEstimate of(const WorkLeft& left, std::size_t mine) {
    out_.points = mine;
    out_.found = left.found;
    out_.workers = std::clamp<std::size_t>(std::min(options_.jobs, options_.threads), 1,
                                           std::max<std::size_t>(left.groups.size(), 1));
    threads_each_ = std::max<std::size_t>(1, options_.threads / out_.workers);
    for (const std::vector<std::size_t>& group : left.groups) add(group);
    for (const auto& [capture, frame] : measured_) {
      out_.render_seconds += frame.render / static_cast<double>(measured_.size());
      out_.timing_seconds += frame.timing / static_cast<double>(measured_.size());
    }
    out_.seconds = std::max(longest_, work_ / static_cast<double>(out_.workers));
    return out_;
  }

 private:
  // Seconds of one frame of a capture, with one worker's threads.
  struct FrameSeconds {
    double render = 0, timing = 0;
    double pixels = 0;
    int frames = 0;  // frames of a point
  };

  void add(const std::vector<std::size_t>& group) {
    const SweepPoint& first = points_[group.front()];
    if (!first.fault.empty()) {
      out_.refused += group.size();
      return;
    }
    ++out_.renders;
    out_.timings += group.size() - 1;
    if (!measured_.contains(first.capture))
      with_threads(threads_each_, [&] { measure(first, points_[group.back()], group.size() > 1); });
    const auto at = measured_.find(first.capture);
    if (at == measured_.end()) return;
    const FrameSeconds& frame = at->second;
    const double frames = frame.frames * pixels_of(first) / frame.pixels;
    const double seconds = frames * (frame.render + frame.timing * static_cast<double>(group.size() - 1) /
                                                        static_cast<double>(threads_each_));
    work_ += seconds;
    longest_ = std::max(longest_, seconds);
  }

  void measure(const SweepPoint& point, const SweepPoint& other, bool times) {
    const CaptureLibrary::Loaded capture = library_.get(point.capture);
    const CaptureLibrary::Lease lease(library_);
    own_ = capture.capture->settings;
    const FrameRange range = study_.frames.value_or(FrameRange{own_.first_frame, own_.first_frame + own_.frame_count});
    ImageMemory memory(options_.max_bytes);
    FrameSeconds frame{0, 0, pixels_of(point), range.last - range.first};
    try {
      double inside = 0;
      const Stopwatch render;
      const RenderedPoint rendered =
          render_point({study_, needs_items(study_), true, nullptr, FrameRange{range.first, range.first + 1}}, point,
                       capture, memory, inside);
      frame.render = render.seconds();
      const Stopwatch timing;
      if (times) timed_frames(study_, configure_point(study_, other.steps).gpu, rendered);
      if (times) frame.timing = timing.seconds();
    } catch (const UsageError&) {
      return;  // no machine; another point may be one
    }
    measured_[point.capture] = frame;
  }

  // Captures of a study that says no size may differ in theirs: each is measured at its own.
  double pixels_of(const SweepPoint& point) const {
    const std::optional<ImageSize> size = configure_point(study_, point.steps).size;
    return size ? static_cast<double>(size->width) * static_cast<double>(size->height)
                : static_cast<double>(own_.width) * static_cast<double>(own_.height);
  }

  const Study& study_;
  const std::vector<SweepPoint>& points_;
  const SweepOptions& options_;
  CaptureLibrary& library_;
  SweepEstimate out_;
  std::size_t threads_each_ = 1;
  scene::CaptureSettings own_{};                  // of the capture measured last: points come capture by capture
  std::map<std::size_t, FrameSeconds> measured_;  // by capture
  double work_ = 0, longest_ = 0;
};

}  // namespace

SweepEstimate estimate_sweep(const Study& study, const std::vector<SweepPoint>& points,
                             const std::vector<std::size_t>& mine, const SweepFolder& folder,
                             const SweepOptions& options, CaptureLibrary& library) {
  return Estimator(study, points, options, library).of(work_left(points, mine, folder, false), mine.size());
}

std::vector<SweepPoint> expected_points(Study& study, const std::string& program) {
  for (const std::vector<double>& at :
       unit_samples(SampleMethod::kLatinHypercube, study.goal->points, study.axes.size(), study.goal->seed)) {
    std::vector<std::uint32_t>& steps = study.chosen.emplace_back();
    for (std::size_t a = 0; a < study.axes.size(); ++a) steps.push_back(study.axes[a].step_at(at[a]));
  }
  return expand_points(study, program);
}

}  // namespace tessera::replay
