#include "replay/reserved_space.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera::replay {

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
