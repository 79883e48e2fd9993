#pragma once

#include <map>
#include <string_view>

namespace tessera::replay {

// The files of replay/report/page/ by name, built into the program.
const std::map<std::string_view, std::string_view>& page_files();

}  // namespace tessera::replay
