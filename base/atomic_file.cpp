#include "base/atomic_file.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

// Unique among the threads and processes that may write to one folder at the same time.
std::string unique_suffix() {
  static std::atomic<unsigned> count{0};
  return fmt::format(".{}-{}.part", ::getpid(), count.fetch_add(1));
}

[[noreturn]] void fail(const fs::path& target, const std::string& reason) {
  throw WriteError(fmt::format("cannot write {}: {}", target.string(), reason));
}

// While it lives, a write of this thread to a pipe without a reader raises no signal.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    sigset_t pending;
    ::sigpending(&pending);
    was_pending_ = ::sigismember(&pending, SIGPIPE) == 1;
    ::sigemptyset(&pipe_);
    ::sigaddset(&pipe_, SIGPIPE);
    ::pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoPipeSignal() {
    const timespec at_once{0, 0};
    if (!was_pending_)
      while (::sigtimedwait(&pipe_, nullptr, &at_once) < 0 && errno == EINTR) {
      }
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  sigset_t pipe_, before_;
  bool was_pending_;
};

}  // namespace

AtomicFile::AtomicFile(fs::path target)
    : target_(std::move(target)), place_(link_end(target_)), temporary_(place_.string() + unique_suffix()) {
  check_place();
  if (place_.has_parent_path()) make_folder(place_.parent_path());
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::check_place() const {
  std::error_code ignored;
  if (const std::string kind = irregular_kind(fs::symlink_status(place_, ignored)); !kind.empty()) fail(target_, kind);
}

void AtomicFile::write(std::string_view bytes) {
  if (descriptor_ < 0) descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  const int reason = descriptor_ < 0 ? errno : write_all(descriptor_, bytes);
  if (reason != 0) fail(target_, std::strerror(reason));
}

void AtomicFile::commit() {
  // Some file systems report a full disk only here.
  if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0) fail(target_, std::strerror(errno));
  check_place();
  std::error_code error;
  fs::rename(temporary_, place_, error);
  if (error) fail(target_, error.message());
  committed_ = true;
}

void write_file_atomically(const fs::path& target, std::string_view bytes) {
  AtomicFile file(target);
  file.write(bytes);
  file.commit();
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw WriteError(fmt::format("cannot create the folder {}: {}", folder.string(), error.message()));
}

fs::path link_end(fs::path path) {
  constexpr int kMaxLinks = 40;  // as Linux
  std::error_code error;
  for (int links = 0; links < kMaxLinks && fs::is_symlink(fs::symlink_status(path, error)); ++links) {
    const fs::path to = fs::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / to;
  }
  return path;
}

std::string irregular_kind(fs::file_status status) {
  switch (status.type()) {
    case fs::file_type::directory:
      return "is a folder";
    case fs::file_type::symlink:
      return "is a loop of symlinks";
    case fs::file_type::block:
      return "is a block device";
    case fs::file_type::character:
      return "is a character device";
    case fs::file_type::fifo:
      return "is a FIFO";
    case fs::file_type::socket:
      return "is a socket";
    default:
      return "";
  }
}

int write_all(int descriptor, std::string_view bytes) {
  const NoPipeSignal guard;
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // a descriptor that was handed to us in this mode
      pollfd ready{descriptor, POLLOUT, 0};
      ::poll(&ready, 1, -1);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

}  // namespace tessera
