#include "replay/output_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

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

void OutputLock::remove_made() {
  // Empty ones alone.
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder)
    if (::rmdir(folder->c_str()) != 0) return;
}

}  // namespace tessera::replay
