#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tessera::test {

// End of a process and its output.
struct ProcessResult {
  int status = -1;  // exit status, or -1 when a signal ended it
  int signal = 0;
  bool timed_out = false;
  std::string output, errors;
};

struct ProcessLimits {
  std::uint64_t memory_bytes = 0;     // address space; 0: no limit (the address sanitizer needs none)
  int seconds = 120;                  // wall clock; the process is killed after that
  int interrupt_after_ms = -1;        // SIGINT after so many milliseconds
  std::function<bool()> kill_when{};  // SIGKILL once it returns true; called about every 20 milliseconds
};

// Runs a program (argv[0] is its path) and waits for it.
ProcessResult run_process(const std::vector<std::string>& argv, const ProcessLimits& limits = {});

// Runs the tessera program of this build; for test programs with RUNS in tests/CMakeLists.txt.
ProcessResult run_tessera(std::vector<std::string> arguments, const ProcessLimits& limits = {});

}  // namespace tessera::test
