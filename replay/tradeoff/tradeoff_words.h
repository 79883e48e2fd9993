#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// One line about a setting (a row of tradeoff.json) beside the one that its knob compares with: what it costs or gains
// in decibels, and by how much cycles, bytes, energy and what the knob watches change. From figures of the emulated
// machine alone: host times differ from run to run.
//   "cubic, 8-bit weights: costs 0.10 dB against cubic, float weights; saves 12.0 % of resolve cycles"
std::string setting_in_words(const nlohmann::json& row, const nlohmann::json& against, const nlohmann::json& knob);

}  // namespace tessera::replay
