#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::replay {

// Folders in which Vega's modules are looked for, first come first served. The environment variable TESSERA_VEGA, where
// set, is the only one; else the folder that the build was given (TESSERA_VEGA_FOLDER), and below each of XDG_DATA_HOME
// and XDG_DATA_DIRS (by default ~/.local/share, /usr/local/share, /usr/share) the folders that distributions and npm
// use.
std::vector<std::filesystem::path> vega_folders();

// The file of a module ("vega-util"): FOLDER/vega-util.min.js, or FOLDER/vega-util/build/vega-util.min.js as npm has
// it. Empty when no folder holds it.
std::filesystem::path find_vega_module(const std::string& name);

}  // namespace tessera::replay
