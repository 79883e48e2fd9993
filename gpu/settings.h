#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"
#include "hardware/configuration.h"
#include "tilecore/procedural/parameter_maps.h"

namespace tessera::gpu {

// What a user chooses about a replay, besides the described machine. Every member is a key of settings_keys().
struct RunSettings {
  std::int64_t samples_per_pixel = 4;
  std::int64_t seed = 0;
  std::string temporal_pattern = "8x8";
  std::string time_bits = "8";
  std::int64_t lens_points = 0;
  double target_edge_pixels = 3.0;
  double displacement_bias = 0;
  std::string shading_rate = "pixel";
  double shading_cell_pixels = 1.0;
  std::string shading_attributes = "float";
  std::string motion = "auto";
  std::string defocus = "auto";
  std::string displacement = "auto";
  std::string alpha_test = "auto";
  std::string blending = "auto";
  std::string procedures = "auto";
  bool machine_model = true;
  double exposure = 0;  // 0: the capture's

  std::string desampling = "off";
  double k_stat = 2.0, k_fast1 = 2.0, k_fast2 = 8.0;  // pixels per frame
  double hysteresis = 0.05;
  std::string block_speed = "mean";
  std::string edges = "inverse_depth";
  double edge_threshold = 0.01;
  std::string edge_evidence = "surface";
  bool supersampling = false;
  bool advect_still_edges = true;
  std::string dither = "counter";
  bool dither_per_block = false;
  bool advection = true;
  std::string advection_fetch = "bilinear";
  bool bfecc = false;
  double depth_tolerance = 0.02;
  std::string discrepancy = "rendered";
  double discrepancy_tolerance = 0.04;
  std::int64_t discrepancy_frames = 4;
  std::string reconstruction = "cubic";
  std::string stencil_weights = "packed";
  bool stencil_clamp = false;
  std::string stencil_reach = "tile";
  double foveation_r0 = 0, foveation_r1 = 0;  // pixels; 0: off
  double focus_x = 0.5, focus_y = 0.5;        // of the frame
  double eye_separation = 0;                  // 0: one eye
  double far_depth = 10;
  // Procedures; see tilecore/procedural/parameter_maps.h.
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

// Sets whichever of the two has the key. Throws UsageError for an unknown key (naming the nearest known one) or a value
// out of range.
void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings,
             hardware::GpuConfiguration& gpu);

// All keys that set_key knows.
const std::vector<std::string>& known_keys();
// The part that the sampling controller works by.
tilecore::ProcedureSettings procedure_settings(const RunSettings& settings);

// Applies "KEY=VALUE" to whichever of the two has the key. Throws UsageError for a text without "=", an unknown key
// (naming the nearest known one) or a value out of range.
void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu);

}  // namespace tessera::gpu
