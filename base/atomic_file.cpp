#include "base/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera {
namespace {

// Unique among the threads and processes that may write to one folder at the same time.
std::string unique_suffix() {
  static std::atomic<unsigned> count{0};
  return fmt::format(".{}-{}.part", ::getpid(), count.fetch_add(1));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)), temporary_(target_) {
  temporary_ += unique_suffix();
  if (!target_.has_parent_path()) return;
  std::error_code error;
  std::filesystem::create_directories(target_.parent_path(), error);
  if (error)
    throw SystemError(fmt::format("cannot create the folder {}: {}", target_.parent_path().string(), error.message()));
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
  const int descriptor = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  bool good = descriptor >= 0;
  int reason = errno;
  while (good && !bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    good = written > 0;
    if (good)
      bytes.remove_prefix(static_cast<std::size_t>(written));
    else
      reason = errno;
  }
  // Some file systems report a full disk only here.
  if (descriptor >= 0 && ::close(descriptor) != 0 && good) {
    good = false;
    reason = errno;
  }
  if (!good) throw SystemError(fmt::format("cannot write {}: {}", target_.string(), std::strerror(reason)));
}

void AtomicFile::commit() {
  std::error_code error;
  std::filesystem::rename(temporary_, target_, error);
  if (error) throw SystemError(fmt::format("cannot write {}: {}", target_.string(), error.message()));
  committed_ = true;
}

void write_file_atomically(const std::filesystem::path& target, std::string_view bytes) {
  AtomicFile file(target);
  file.write(bytes);
  file.commit();
}

}  // namespace tessera
