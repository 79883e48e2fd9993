#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"
#include "hardware/configuration.h"
#include "tilecore/parameter_maps.h"

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
  double exposure = 0;  // 0: the capture's

  // Procedures; see tilecore/parameter_maps.h.
  std::string procedures_path = "sampled";
  std::string procedures_maps = "interval";
  std::string procedures_scatter = "footprint";
  std::string procedures_style = "surface";
  double procedures_spacing = 1.0;
  double procedures_cell_pixels = 12;
  double procedures_padding = 0.5;
  double procedures_sparse_spacing = 2;
  bool procedures_refill = false;
  std::int64_t procedures_lanes = 32;
};

const KeyTable<RunSettings>& settings_keys();
nlohmann::json settings_json(const RunSettings& settings);

// The part that the sampling controller works by.
tilecore::ProcedureSettings procedure_settings(const RunSettings& settings);

// Applies "KEY=VALUE" to whichever of the two has the key. Throws UsageError for a text without "=", an unknown key
// (naming the nearest known one) or a value out of range.
void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu);

}  // namespace tessera::replay
