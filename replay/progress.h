#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace tessera::replay {

// Progress of long work on standard error: a bar with the time left on a terminal, one plain line per step
// otherwise, nothing when quiet.
class Progress {
 public:
  Progress(std::size_t total, bool quiet);
  ~Progress();

  // `done` steps are finished; `note` says what the last one was.
  void update(std::size_t done, const std::string& note);

 private:
  std::size_t total_;
  bool quiet_, terminal_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point start_;
};

// Turns SIGINT and SIGTERM into a request that long work looks at between its steps. A second signal ends at once.
void install_stop_handler();
bool stop_requested();

}  // namespace tessera::replay
