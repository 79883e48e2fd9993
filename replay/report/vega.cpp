#include "replay/report/vega.h"

#include <cstdlib>
#include <sstream>

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

// What a variable says, or what the XDG base directory specification says instead.
std::string variable(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : otherwise;
}

}  // namespace

std::vector<fs::path> vega_folders() {
  if (const char* folder = std::getenv("TESSERA_VEGA"); folder != nullptr) return {folder};
  std::vector<fs::path> folders;
#ifdef TESSERA_VEGA_FOLDER
  folders.emplace_back(TESSERA_VEGA_FOLDER);
#endif
  std::istringstream shares(variable("XDG_DATA_HOME", variable("HOME", "") + "/.local/share") + ":" +
                            variable("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
  for (std::string share; std::getline(shares, share, ':');)
    for (const char* below :
         {"javascript/vega", "vega", "../lib/node_modules", "../lib/node_modules/vega/node_modules"})
      folders.push_back((fs::path(share) / below).lexically_normal());
  return folders;
}

fs::path find_vega_module(const std::string& name) {
  const std::string file = name + ".min.js";
  std::error_code ignored;
  for (const fs::path& folder : vega_folders())
    for (const fs::path& candidate : {folder / file, folder / name / "build" / file})
      if (fs::is_regular_file(candidate, ignored)) return candidate;
  return {};
}

}  // namespace tessera::replay
