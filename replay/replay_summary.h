#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace tessera::replay {

// What a replay ends with, five lines: time, what bounds it, traffic, energy, where the results are; each figure of a
// frame on average. `statistics`: stats.json, of at least one frame; `results`: the fifth line's text.
std::string replay_summary(const nlohmann::json& statistics, const std::string& results);

}  // namespace tessera::replay
