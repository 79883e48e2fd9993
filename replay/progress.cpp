#include "replay/progress.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <numeric>
#include <utility>

#include <fmt/format.h>

namespace tessera::replay {
namespace {

volatile std::sig_atomic_t g_stop_requested = 0;

extern "C" void on_stop_signal(int signal) {
  if (g_stop_requested) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  g_stop_requested = 1;
}

}  // namespace

void install_stop_handler() {
  std::signal(SIGINT, on_stop_signal);
  std::signal(SIGTERM, on_stop_signal);
}

bool stop_requested() { return g_stop_requested != 0; }

Progress::Progress(std::size_t total, bool quiet, std::function<StepProgress()> inside)
    : Progress(std::vector<double>(total, 1.0), quiet, std::move(inside)) {}

Progress::Progress(const std::vector<double>& works, bool quiet, std::function<StepProgress()> inside)
    : total_(works.size()),
      work_before_(works.size() + 1, 0.0),
      quiet_(quiet),
      terminal_(::isatty(STDERR_FILENO) != 0),
      inside_(std::move(inside)),
      start_(Clock::now()),
      step_start_(start_) {
  std::partial_sum(works.begin(), works.end(), work_before_.begin() + 1);
  if (!quiet_ && inside_) watcher_ = std::thread([this] { watch(); });
}

Progress::~Progress() {
  if (watcher_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      finished_ = true;
    }
    changed_.notify_one();
    watcher_.join();
  }
  if (line_open_) std::fputc('\n', stderr);
}

void Progress::update(std::size_t done, const std::string& note) {
  if (quiet_) return;
  const std::lock_guard lock(mutex_);
  done_ = done;
  step_start_ = Clock::now();
  show(note, 0, inside_ && done_ < total_ ? inside_().seconds_left : std::nullopt);
}

void Progress::show(const std::string& note, double share, std::optional<double> seconds_left) {
  // The time that less work took says little.
  constexpr double kEnough = 0.02;
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  const double before = work_before_[done_], all = work_before_.back();
  const double done = all > 0 ? (before + share * (work_before_[std::min(done_ + 1, total_)] - before)) / all : 1;
  if (!seconds_left && done > kEnough && done < 1) seconds_left = elapsed / done * (1 - done);
  const std::string time_left = seconds_left ? fmt::format("{:.0f} s left", *seconds_left) : "";
  if (!terminal_) {
    std::fprintf(stderr, "%s\n",
                 fmt::format("[{}/{}] {}{}{}", done_, total_, note, time_left.empty() ? "" : ", ", time_left).c_str());
    return;
  }
  constexpr std::size_t kWidth = 30;
  const std::size_t filled = std::min(kWidth, static_cast<std::size_t>(done * static_cast<double>(kWidth)));
  std::fprintf(stderr, "%s",
               fmt::format("\r\033[K[{}{}] {}/{}  {}  {}", std::string(filled, '#'), std::string(kWidth - filled, '.'),
                           done_, total_, note, time_left)
                   .c_str());
  std::fflush(stderr);
  line_open_ = true;
}

void Progress::watch() {
  const auto often = terminal_ ? std::chrono::milliseconds(500) : std::chrono::milliseconds(10000);
  const auto first = std::chrono::milliseconds(1000);
  std::unique_lock lock(mutex_);
  Clock::time_point shown = start_ - often;
  while (!finished_) {
    changed_.wait_until(lock, std::max(step_start_ + first, shown + often), [this] { return finished_; });
    const Clock::time_point now = Clock::now();
    if (finished_ || now < step_start_ + first || now < shown + often) continue;
    shown = now;
    if (done_ == total_) continue;
    const StepProgress inside = inside_();
    show(inside.text, inside.share, inside.seconds_left);
  }
}

LongStep::LongStep(std::string what, bool quiet) : start_(std::chrono::steady_clock::now()) {
  if (!quiet) watcher_ = std::thread([this, what = std::move(what)] { watch(what); });
}

LongStep::~LongStep() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  done_.notify_one();
  watcher_.join();
}

bool LongStep::quiet_without_terminal() { return ::isatty(STDERR_FILENO) == 0; }

double LongStep::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void LongStep::watch(const std::string& what) {
  const bool terminal = ::isatty(STDERR_FILENO) != 0;
  std::unique_lock lock(mutex_);
  const auto finished_by = [&](std::chrono::milliseconds time) {
    return done_.wait_until(lock, start_ + time, [this] { return finished_; });
  };
  for (std::chrono::milliseconds time(1000); !finished_by(time); time += std::chrono::milliseconds(500)) {
    if (!terminal) {
      std::fprintf(stderr, "%s\n", what.c_str());
      done_.wait(lock, [this] { return finished_; });
      return;
    }
    std::fprintf(stderr, "\r\033[K%s  %.1f s", what.c_str(), static_cast<double>(time.count()) / 1000);
    std::fflush(stderr);
  }
  if (terminal && seconds() >= 1) std::fprintf(stderr, "\r\033[K");
}

}  // namespace tessera::replay
