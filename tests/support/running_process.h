#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/support/process.h"

namespace tessera::test {

// A program that runs beside the test; it is killed with this object.
class RunningProcess {
 public:
  // With `channel`, the program also reads from descriptor 3 and writes to descriptor 4.
  explicit RunningProcess(const std::vector<std::string>& argv, bool channel = false);
  ~RunningProcess();
  RunningProcess(const RunningProcess&) = delete;
  RunningProcess& operator=(const RunningProcess&) = delete;

  pid_t id() const { return child_; }
  // Reads output up to the next `end`, which is left out; "" when none comes in time.
  std::string read_line(double seconds = 60) { return read_until(output_, '\n', seconds); }
  // Reads descriptor 4 likewise; write_channel() writes to descriptor 3 of the process.
  std::string read_channel(char end, double seconds = 60) { return read_until(from_, end, seconds); }
  void write_channel(const std::string& bytes);

  void interrupt() const;
  // Waits for the end of the process; `output` is the output that was not read before.
  ProcessResult wait(int seconds = 60);

 private:
  struct Source {
    int descriptor = -1;
    std::string pending{};
  };
  std::string read_until(Source& source, char end, double seconds);

  pid_t child_ = -1;
  int errors_ = -1;  // a file in memory: unread output never blocks the process
  int to_ = -1;
  Source output_, from_;
};

}  // namespace tessera::test
