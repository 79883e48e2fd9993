#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::gpu {

// A machine that the program carries: hardware/presets/NAME.json.
struct Preset {
  std::string name, description;
  std::vector<std::string> aliases;  // former names
  nlohmann::json values;             // nested by the dots of the keys; only values that differ from the defaults
  nlohmann::json sources;            // by key: the source of its value
};

// All presets from the smallest to the largest, then the presets that resemble a product.
const std::vector<Preset>& presets();

// Finds a preset by its name or an alias; nullptr if there is none.
const Preset* find_preset(const std::string& name);

}  // namespace tessera::gpu
