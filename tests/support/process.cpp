#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include "tests/support/tests.h"

namespace tessera::test {
namespace {

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    read = ends[0];
    write = ends[1];
  }
};

[[noreturn]] void become(const std::vector<std::string>& argv, const ProcessLimits& limits, int out, int err) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (limits.memory_bytes > 0) {
    const rlimit limit{limits.memory_bytes, limits.memory_bytes};
    setrlimit(RLIMIT_AS, &limit);
  }
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  std::vector<char*> arguments;
  for (const std::string& a : argv) arguments.push_back(const_cast<char*>(a.c_str()));
  arguments.push_back(nullptr);
  // A test program that runs itself runs the tests of its arguments, not a shard of them.
  unsetenv("GTEST_TOTAL_SHARDS");
  unsetenv("GTEST_SHARD_INDEX");
  execv(arguments[0], arguments.data());
  _exit(127);
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& argv, const ProcessLimits& limits) {
  using Clock = std::chrono::steady_clock;
  Pipe out, err;
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) become(argv, limits, out.write, err.write);
  close(out.write);
  close(err.write);

  ProcessResult result;
  const auto start = Clock::now();
  const auto elapsed_ms = [&] {
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - start).count();
  };
  bool interrupted = false, killed = false;
  pollfd ends[2] = {{out.read, POLLIN, 0}, {err.read, POLLIN, 0}};
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    poll(ends, 2, 20);
    for (int k = 0; k < 2; ++k) {
      if (ends[k].fd < 0 || ends[k].revents == 0) continue;
      char buffer[4096];
      const ssize_t count = read(ends[k].fd, buffer, sizeof buffer);
      if (count > 0)
        (k == 0 ? result.output : result.errors).append(buffer, static_cast<std::size_t>(count));
      else if (count == 0)
        close(ends[k].fd), ends[k].fd = -1;
    }
    if (limits.interrupt_after_ms >= 0 && !interrupted && elapsed_ms() >= limits.interrupt_after_ms) {
      kill(child, SIGINT);
      interrupted = true;
    }
    if (limits.kill_when && !killed && limits.kill_when()) {
      kill(child, SIGKILL);
      killed = true;
    }
    if (elapsed_ms() > limits.seconds * 1000 && !result.timed_out) {
      kill(child, SIGKILL);
      result.timed_out = true;
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status))
    result.status = WEXITSTATUS(status);
  else
    result.signal = WTERMSIG(status);
  return result;
}

}  // namespace tessera::test
