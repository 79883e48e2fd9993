#include "replay/input_files.h"

#include <fnmatch.h>
#include <sys/stat.h>

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "scene/gltf/named_files.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

// Device and inode of the regular file behind a path and its links.
std::optional<std::pair<dev_t, ino_t>> identity(const fs::path& file) {
  struct stat there {};
  if (::stat(file.c_str(), &there) != 0 || !S_ISREG(there.st_mode)) return std::nullopt;
  return std::pair(there.st_dev, there.st_ino);
}

}  // namespace

void InputFiles::find_named() const {
  for (const fs::path& capture : std::exchange(captures_, {})) {
    files_.push_back({capture, false});
    for (fs::path& file : scene::gltf::named_files(capture)) files_.push_back({std::move(file), true});
  }
}

void InputFiles::check(const fs::path& target) const {
  const auto wanted = identity(target);
  if (!wanted) return;
  find_named();
  const auto found =
      std::find_if(files_.begin(), files_.end(), [&](const File& file) { return identity(file.path) == wanted; });
  if (found == files_.end()) return;
  throw UsageError(fmt::format("cannot write {}: it is {}, which would be lost; choose another name",
                               escape_control(target.string()),
                               found->named ? "a file that the input names" : "the input"));
}

void InputFiles::check_folder(const fs::path& folder, const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    const fs::path result = folder / name;
    if (name.find('*') == std::string::npos) {
      check(result);
      continue;
    }
    std::error_code error;
    for (fs::directory_iterator at(result.parent_path(), error), end; !error && at != end; at.increment(error))
      if (::fnmatch(result.filename().c_str(), at->path().filename().c_str(), 0) == 0) check(at->path());
  }
}

}  // namespace tessera::replay
