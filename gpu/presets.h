#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::gpu {

// A machine that the program carries: hardware/presets/NAME.json.
struct Preset {
  std::string name, description;
  std::vector<std::string> aliases;  // what it was called before
  nlohmann::json values;             // nested by the dots of the keys; what it changes against the defaults
  nlohmann::json sources;            // by key: where its value is from
};

// From the smallest to the largest, those that resemble a part behind them.
const std::vector<Preset>& presets();

// By its name or an alias; null: none.
const Preset* find_preset(const std::string& name);

}  // namespace tessera::gpu
