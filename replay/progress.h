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

// How far a step is.
struct StepProgress {
  std::string text;
  double share = 0;                    // of the step, 0 to 1
  std::optional<double> seconds_left;  // of all steps, where the work knows better than the shares of steps do

  StepProgress(std::string said, double part = 0, std::optional<double> left = {})
      : text(std::move(said)), share(part), seconds_left(left) {}
};

// Progress of long work on standard error: a bar with the time left on a terminal, one plain line per step
// otherwise, nothing when quiet.
class Progress {
 public:
  // Steps that are alike. `inside` says how far the step in hand is. It is asked when that takes more than a second, on another thread: twice
  // a second on a terminal, else then and every ten seconds; and after each step, for the time left.
  Progress(std::size_t total, bool quiet, std::function<StepProgress()> inside = {});
  // Steps of which each takes as long as its share of the sum of `works`, none of them negative, says.
  Progress(const std::vector<double>& works, bool quiet, std::function<StepProgress()> inside = {});
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` steps are finished; `note` says what the last one was.
  void update(std::size_t done, const std::string& note);

 private:
  using Clock = std::chrono::steady_clock;
  void watch();
  // With mutex_ held.
  void show(const std::string& note, double share, std::optional<double> seconds_left);

  std::size_t total_, done_ = 0;
  std::vector<double> work_before_;  // each step; the last is the sum
  bool quiet_, terminal_;
  bool line_open_ = false, finished_ = false;
  std::function<StepProgress()> inside_;
  Clock::time_point start_, step_start_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread watcher_;  // none without `inside`
};

// Work without steps of its own, while it lives: nothing for a second, then on a terminal a line with the time so far,
// which goes when the work is done, otherwise one plain line; nothing when quiet.
class LongStep {
 public:
  LongStep(std::string what, bool quiet);
  ~LongStep();
  LongStep(const LongStep&) = delete;
  LongStep& operator=(const LongStep&) = delete;

  double seconds() const;

  // For commands without --quiet: said on terminals only.
  static bool quiet_without_terminal();

 private:
  void watch(const std::string& what);

  std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  std::condition_variable done_;
  bool finished_ = false;
  std::thread watcher_;  // none when quiet
};

// Turns SIGINT and SIGTERM into a request that long work looks at between its steps. A second signal ends at once.
void install_stop_handler();
bool stop_requested();

}  // namespace tessera::replay
