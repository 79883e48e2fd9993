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
  nlohmann::json view;  // as pages have it (replay/report/report.h), without "image"
};

// What came of a request.
struct ViewResult {
  std::uint64_t revision = 0;
  bool rendered = false;  // else timed
  bool stale = false;     // timed, with the counters of other cache sizes: rendered next
  bool kept = false;      // in the history
  double seconds = 0;     // that it took
  int frame = 0;
  nlohmann::json changes;  // {KEY: value} against the start
  std::string command;     // the `tessera replay` that gives the same
  nlohmann::json stats;    // tessera.stats/1
  nlohmann::json summary;  // {"cycles", "ms", "energy_nj", "dram_bytes", "bound_by"}
  ViewImage image;
};

// A frame of a capture whose settings and machine someone changes while looking at it: renders or times it anew on a
// thread of its own and says what came of it.
//
// Invariants (cited by the tests):
//   VWS1  A result has the statistics and the image that `tessera replay` gives for its command line.
//   VWS2  The newest request wins: a frame in hand that it would render otherwise is abandoned.
//   VWS3  A request that changes only what timing reads renders nothing.
//   VWS4  A request that is refused changes nothing.
//   VWS5  What the frame takes without a drawable is what `tessera replay --without` says of the newest result's command
//         line. A request for another frame, other settings or another machine ends the measurement.
class ViewSession {
 public:
  // Called on the session's thread; state() tells the rest.
  using Told = std::function<void(const std::shared_ptr<const ViewResult>&)>;

  ViewSession(ViewStart start, std::uint64_t max_bytes);
  ~ViewSession();
  ViewSession(const ViewSession&) = delete;
  ViewSession& operator=(const ViewSession&) = delete;

  // Renders the start, then whatever is asked for, until stop().
  void run(Told told);
  void stop();
  // True once the start is rendered, false when nothing came within so many milliseconds. Throws what rendering threw.
  bool wait_for_start(int milliseconds);

  // ViewSpace::changed() of the request before. `keep`: in the history; not while a slider is on its way. Returns the
  // request's revision.
  std::uint64_t request(const nlohmann::json& changes, bool keep);

  // Renders and times the newest result's frame without each drawable, or without the one that `part` names: {} or
  // {"node": TEXT, "material": TEXT}. Ends what was measured before. Throws UsageError, also before the start is rendered.
  void measure_without(const nlohmann::json& part);
  void cancel_measuring();
  // {} before any was asked for, else {"revision": of the result, "phase": "measuring" | "done" | "cancelled" | "failed",
  // "done", "all": of parts, "rows": as "drawables" of LeaveOneOut::measure(), "error"}.
  nlohmann::json left_out() const;

  // Null before the start is rendered.
  std::shared_ptr<const ViewResult> result() const;
  // {"revision", "phase": "rendering" | "timing" | "idle" | "failed", "done", "tiles", "error"}
  nlohmann::json state() const;
  // Results that were kept, that of the start first: {"revision", "rendered", "seconds", "frame", "changes", "summary"}.
  nlohmann::json history() const;
  const ViewSpace& space() const { return space_; }

 private:
  struct Rendering;  // a frame that was rendered, to be timed anew

  void work();
  void serve(const ViewPoint& point);
  void render(const ViewPoint& point);
  void time(const ViewPoint& point, bool stale);
  // A check that it is too large comes before.
  void check_memory(const ViewPoint& point) const;
  bool can_time(const ViewPoint& point) const;
  void leave_out(const std::optional<DrawableName>& only);
  void publish(const ViewPoint& point, bool rendered, bool stale, double seconds);
  void remember(const ViewResult& result);
  // With mutex_ held.
  void end_measuring();
  void set_phase(const ViewPoint& point, const char* phase, const std::string& error = "");

  const ViewSpace space_;
  const std::uint64_t max_bytes_;
  std::shared_ptr<const gpu::PreparedCapture> prepared_;
  Told told_;
  std::unique_ptr<Rendering> rendering_;  // the session's thread's own
  std::uint64_t images_ = 0;
  std::optional<ViewPoint> shown_;  // of the newest result; the session's thread's own

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  ViewPoint wanted_;
  std::optional<ViewPoint> in_hand_;  // that device_ renders
  gpu::Device* device_ = nullptr;
  std::shared_ptr<const ViewResult> result_;
  std::exception_ptr start_failure_;
  // Something is to be measured: one drawable, or each of them.
  struct LeftOutWanted {
    std::optional<DrawableName> only;
  };
  std::optional<LeftOutWanted> left_out_wanted_;
  gpu::Device* measuring_ = nullptr;  // that renders without a drawable
  bool end_measuring_ = false;
  nlohmann::json state_, left_out_ = nlohmann::json::object(), history_ = nlohmann::json::array();
  bool stop_ = false;
  std::thread worker_;
};

}  // namespace tessera::replay
