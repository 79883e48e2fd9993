#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include "tests/support/running_process.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

using Clock = std::chrono::steady_clock;

// Both ends above the descriptors that a child is given.
struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    read = fcntl(ends[0], F_DUPFD_CLOEXEC, 10);
    write = fcntl(ends[1], F_DUPFD_CLOEXEC, 10);
    close(ends[0]);
    close(ends[1]);
  }
};

}  // namespace

RunningProcess::RunningProcess(const std::vector<std::string>& argv, bool channel) {
  const Pipe out, to, from;
  errors_ = memfd_create("errors", MFD_CLOEXEC);
  child_ = fork();
  if (child_ < 0) throw std::runtime_error("cannot fork");
  if (child_ == 0) {
    dup2(out.write, STDOUT_FILENO);
    dup2(errors_, STDERR_FILENO);
    if (channel) {
      dup2(to.read, 3);
      dup2(from.write, 4);
    }
    std::vector<char*> arguments;
    for (const std::string& a : argv) arguments.push_back(const_cast<char*>(a.c_str()));
    arguments.push_back(nullptr);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(out.write);
  close(to.read);
  close(from.write);
  output_.descriptor = out.read;
  from_.descriptor = from.read;
  to_ = to.write;
}

RunningProcess::~RunningProcess() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  for (const int descriptor : {output_.descriptor, from_.descriptor, to_, errors_}) close(descriptor);
}

void RunningProcess::write_channel(const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t count = write(to_, bytes.data() + at, bytes.size() - at);
    if (count <= 0) throw std::runtime_error("the channel is closed");
    at += static_cast<std::size_t>(count);
  }
}

std::string RunningProcess::read_until(Source& source, char end, double seconds) {
  const Clock::time_point last =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  for (;;) {
    if (const std::size_t at = source.pending.find(end); at != std::string::npos) {
      std::string line = source.pending.substr(0, at);
      source.pending.erase(0, at + 1);
      return line;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(last - Clock::now()).count();
    pollfd ready{source.descriptor, POLLIN, 0};
    if (left <= 0 || poll(&ready, 1, static_cast<int>(left)) <= 0) return "";
    char buffer[65536];
    const ssize_t count = read(source.descriptor, buffer, sizeof buffer);
    if (count <= 0) return "";
    source.pending.append(buffer, static_cast<std::size_t>(count));
  }
}

void RunningProcess::interrupt() const { kill(child_, SIGINT); }

ProcessResult RunningProcess::wait(int seconds) {
  ProcessResult result;
  int status = 0;
  const Clock::time_point last = Clock::now() + std::chrono::seconds(seconds);
  while (waitpid(child_, &status, WNOHANG) == 0) {
    if (Clock::now() > last) {
      kill(child_, SIGKILL);
      result.timed_out = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  child_ = -1;
  if (WIFEXITED(status))
    result.status = WEXITSTATUS(status);
  else
    result.signal = WTERMSIG(status);
  result.output = output_.pending;
  char buffer[4096];
  for (ssize_t count = 0; (count = read(output_.descriptor, buffer, sizeof buffer)) > 0;)
    result.output.append(buffer, static_cast<std::size_t>(count));
  lseek(errors_, 0, SEEK_SET);
  for (ssize_t count = 0; (count = read(errors_, buffer, sizeof buffer)) > 0;)
    result.errors.append(buffer, static_cast<std::size_t>(count));
  return result;
}

}  // namespace tessera::test
