#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace tessera::replay {

// A value of a key as people write it.
std::string value_text(const nlohmann::json& value);

// Keys in which two machines, presets or files, differ: {"key", "a", "b", "unit", "pass", "meaning"}. Throws what
// gpu::load_gpu() throws.
nlohmann::json machine_difference(const std::string& a, const std::string& b);
// The same as a table, with the names and descriptions of both.
std::string machine_difference_text(const std::string& a, const std::string& b);

}  // namespace tessera::replay
