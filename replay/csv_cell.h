#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// One value of a comma-separated file: null is empty, numbers as JSON has them, texts quoted where they must be.
std::string csv_cell(const nlohmann::json& value);

}  // namespace tessera::replay
