#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"
#include "hardware/configuration.h"

namespace tessera::replay {

// What a user chooses about a replay, besides the described machine. Every member is a key of settings_keys().
struct RunSettings {
  std::int64_t samples_per_pixel = 4;
  std::int64_t seed = 0;
  std::string temporal_pattern = "8x8";
  std::string time_bits = "8";
  double target_edge_pixels = 3.0;
  std::string shading_rate = "pixel";
  double shading_cell_pixels = 1.0;
  std::string motion = "auto";
  std::string defocus = "auto";
  bool machine_model = true;
  double exposure = 0;  // 0: the capture's
};

const KeyTable<RunSettings>& settings_keys();
nlohmann::json settings_json(const RunSettings& settings);

// Sets whichever of the two has the key. Throws UsageError for an unknown key (naming the nearest known one) or a value out
// of range.
void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings, hardware::GpuConfiguration& gpu);

// All keys that set_key knows.
const std::vector<std::string>& known_keys();

// Applies "KEY=VALUE" to whichever of the two has the key. Throws UsageError for a text without "=", an unknown key
// (naming the nearest known one) or a value out of range.
void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu);

}  // namespace tessera::replay
