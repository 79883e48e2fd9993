#include "replay/output_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <regex>
#include <utility>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace tessera::replay {

namespace fs = std::filesystem;

OutputLock::OutputLock(const fs::path& folder, Share share) {
  std::error_code ignored;
  fs::path place = fs::absolute(folder.empty() ? "." : folder, ignored).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();  // DIR/
  for (fs::path at = place; !fs::exists(at, ignored) && at.has_relative_path(); at = at.parent_path())
    made_.insert(made_.begin(), at);
  make_folder(place);
  descriptor_ = ::open(place.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) return;
  if (::flock(descriptor_, (share == Share::kAlone ? LOCK_EX : LOCK_SH) | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  descriptor_ = -1;
  throw WriteError(
      fmt::format("cannot write to {}: another tessera is at work there; wait for it, or choose another --out",
                  escape_control(folder.string())));
}

OutputLock::~OutputLock() {
  remove_made();
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputLock::remove_unfinished(const fs::path& folder) {
  static const std::regex kOurs(
      "(frame_[0-9]+(\\.right)?\\.(exr|png)|tiles_[0-9]+\\.json|stats\\.(json|csv)|baselines\\.csv|report\\.html)"
      "\\.[0-9]+-[0-9]+\\.part");
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (std::regex_match(at->path().filename().string(), kOurs)) fs::remove(at->path(), ignored);
  }
}

void OutputLock::remove_made() {
  // Empty ones alone.
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder)
    if (::rmdir(folder->c_str()) != 0) return;
}

void ReservedSpace::grow(std::uint64_t bytes) {
  if (bytes <= bytes_) return;
  if (descriptor_ < 0) descriptor_ = ::open(folder_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (descriptor_ < 0) return;
  while (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) != 0) {
    if (errno == EINTR) continue;
    if (errno == ENOSPC || errno == EDQUOT)
      throw WriteError(fmt::format("cannot write to {}: {}", escape_control(folder_.string()), std::strerror(errno)));
    return;  // not here
  }
  bytes_ = bytes;
}

void ReservedSpace::release() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  bytes_ = 0;
}

}  // namespace tessera::replay
