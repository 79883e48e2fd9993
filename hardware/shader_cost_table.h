#pragma once

#include <map>
#include <string_view>

namespace tessera::hardware {

// The text of shader_costs.csv under the file's name.
const std::map<std::string_view, std::string_view>& shader_cost_table();

}  // namespace tessera::hardware
