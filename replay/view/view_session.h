#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <nlohmann/json.hpp>

#include "gpu/device.h"
#include "replay/frame_costs.h"
#include "replay/view/view_point.h"

namespace tessera::replay {

// The image of a frame that was rendered.
struct ViewImage {
  std::uint64_t number = 0;
  std::shared_ptr<const std::string> png;
  nlohmann::json view;  // its view as in pages (replay/report/report.h), without "image"
};

// The result of a request.
struct ViewResult {
  std::uint64_t revision = 0;
  bool rendered = false;  // false: it was timed only
  bool stale = false;     // timed, but with counters for other cache sizes: it is rendered next
  bool kept = false;      // in the history
  double seconds = 0;     // duration of the request
  int frame = 0;
  nlohmann::json changes;  // {KEY: value} against the start
  std::string command;     // the `tessera replay` command that gives the same result
  nlohmann::json stats;    // tessera.stats/1
  nlohmann::json summary;  // {"cycles", "ms", "energy_nj", "dram_bytes", "bound_by"}
  ViewImage image;
};

// Serves a frame of a capture whose settings and machine a user changes interactively: renders or times it again on a
// thread of its own and reports the results.
//
// Invariants (cited by the tests):
//   VWS1  A result has the statistics and the image that `tessera replay` gives for its command line.
//   VWS2  The newest request wins: a current frame that it would render differently is abandoned.
//   VWS3  A request that changes only keys that timing reads renders nothing.
//   VWS4  A refused request changes nothing.
//   VWS5  The figures of a frame without a drawable equal the figures that `tessera replay --without` gives for the
//         newest result's command line. A request for another frame, other settings or another machine ends the
//         measurement.
class ViewSession {
 public:
  // Called on the session's thread; state() tells the rest.
  using Told = std::function<void(const std::shared_ptr<const ViewResult>&)>;

  ViewSession(ViewStart start, std::uint64_t max_bytes);
  ~ViewSession();
  ViewSession(const ViewSession&) = delete;
  ViewSession& operator=(const ViewSession&) = delete;

  // Renders the start, then serves requests until stop().
  void run(Told told);
  void stop();
  // Returns true once the start is rendered, false after so many milliseconds. Throws the error of rendering.
  bool wait_for_start(int milliseconds);

  // Applies ViewSpace::changed() to the previous request. `keep`: whether the result belongs to the history; false
  // while a slider moves. Returns the request's revision.
  std::uint64_t request(const nlohmann::json& changes, bool keep);

  // Renders and times the newest result's frame without each drawable, or without the one that `part` names: {} or
  // {"node": TEXT, "material": TEXT}. Ends an earlier measurement. Throws UsageError, also before the start is
  // rendered.
  void measure_without(const nlohmann::json& part);
  void cancel_measuring();
  // {} before the first measurement, else {"revision": of the result, "phase": "measuring" | "done" | "cancelled" |
  // "failed", "done", "all": numbers of parts, "rows": as "drawables" of LeaveOneOut::measure(), "error"}.
  nlohmann::json left_out() const;

  // Null before the start is rendered.
  std::shared_ptr<const ViewResult> result() const;
  // {"revision", "phase": "rendering" | "timing" | "idle" | "failed", "done", "tiles", "error"}
  nlohmann::json state() const;
  // Kept results, the start's first: {"revision", "rendered", "seconds", "frame", "changes", "summary"}.
  nlohmann::json history() const;
  const ViewSpace& space() const { return space_; }

 private:
  struct Rendering;  // a rendered frame that can be timed again

  void work();
  void serve(const ViewPoint& point);
  void render(const ViewPoint& point);
  void time(const ViewPoint& point, bool stale);
  // Checks the memory of a point before it is rendered.
  void check_memory(const ViewPoint& point) const;
  bool can_time(const ViewPoint& point) const;
  void leave_out(const std::optional<DrawableName>& only);
  void publish(const ViewPoint& point, bool rendered, bool stale, double seconds);
  void remember(const ViewResult& result);
  // Call with mutex_ held.
  void end_measuring();
  void set_phase(const ViewPoint& point, const char* phase, const std::string& error = "");

  const ViewSpace space_;
  const std::uint64_t max_bytes_;
  std::shared_ptr<const gpu::PreparedCapture> prepared_;
  Told told_;
  std::unique_ptr<Rendering> rendering_;  // used by the session's thread alone
  std::uint64_t images_ = 0;
  std::optional<ViewPoint> shown_;  // point of the newest result; used by the session's thread alone

  mutable std::mutex mutex_;  // guards the following members
  std::condition_variable changed_;
  ViewPoint wanted_;
  std::optional<ViewPoint> in_hand_;  // the point that device_ renders
  gpu::Device* device_ = nullptr;
  std::shared_ptr<const ViewResult> result_;
  std::exception_ptr start_failure_;
  // A wanted measurement: one drawable, or each of them.
  struct LeftOutWanted {
    std::optional<DrawableName> only;
  };
  std::optional<LeftOutWanted> left_out_wanted_;
  gpu::Device* measuring_ = nullptr;  // the device that renders without a drawable
  bool end_measuring_ = false;
  nlohmann::json state_, left_out_ = nlohmann::json::object(), history_ = nlohmann::json::array();
  bool stop_ = false;
  std::thread worker_;
};

}  // namespace tessera::replay
