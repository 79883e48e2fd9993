#pragma once

#include <map>
#include <string_view>

namespace tessera::gpu {

// The texts of hardware/presets/, by the names of the files.
const std::map<std::string_view, std::string_view>& preset_files();

}  // namespace tessera::gpu
