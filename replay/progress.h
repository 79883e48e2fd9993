#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tessera::replay {

// Progress of a step.
struct StepProgress {
  std::string text;
  double share = 0;                    // of the step, 0 to 1
  std::optional<double> seconds_left;  // of all steps, if the work can estimate it better than the shares of the steps

  StepProgress(std::string said, double part = 0, std::optional<double> left = {})
      : text(std::move(said)), share(part), seconds_left(left) {}
};

// Progress of long work on standard error: a bar with the time left on a terminal, one plain line per step
// otherwise, nothing when quiet.
class Progress {
 public:
  // Equal steps. `inside` returns the progress of the current step. Another thread calls it when a step takes more than
  // a second: twice a second on a terminal, otherwise once and then every ten seconds; it is also called after each
  // step, for the time left.
  Progress(std::size_t total, bool quiet, std::function<StepProgress()> inside = {});
  // Steps whose durations are proportional to `works`, none of which is negative.
  Progress(const std::vector<double>& works, bool quiet, std::function<StepProgress()> inside = {});
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` steps are finished; `note` describes the last one.
  void update(std::size_t done, const std::string& note);

 private:
  using Clock = std::chrono::steady_clock;
  void watch();
  // Call with mutex_ held.
  void show(const std::string& note, double share, std::optional<double> seconds_left);

  std::size_t total_, done_ = 0;
  std::vector<double> work_before_;  // sum of the works before each step; the last is the sum of all
  bool quiet_, terminal_;
  bool line_open_ = false, finished_ = false;
  std::function<StepProgress()> inside_;
  Clock::time_point start_, step_start_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread watcher_;  // none without `inside`
};

// Reports work without steps of its own while the object lives. On a terminal a line with the elapsed time appears
// after a second and is erased at the end; elsewhere one plain line appears after a second; nothing when quiet.
class LongStep {
 public:
  LongStep(std::string what, bool quiet);
  ~LongStep();
  LongStep(const LongStep&) = delete;
  LongStep& operator=(const LongStep&) = delete;

  double seconds() const;

  // For commands without --quiet: quiet unless standard error is a terminal.
  static bool quiet_without_terminal();

 private:
  void watch(const std::string& what);

  std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  std::condition_variable done_;
  bool finished_ = false;
  std::thread watcher_;  // none when quiet
};

// Turns SIGINT and SIGTERM into a request that long work checks between its steps. A second signal ends the program at
// once.
void install_stop_handler();
bool stop_requested();

}  // namespace tessera::replay
