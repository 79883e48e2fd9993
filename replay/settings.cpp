#include "replay/settings.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"

namespace tessera::replay {

const KeyTable<RunSettings>& settings_keys() {
  using S = RunSettings;
  static const KeyTable<S> table({
      {"sampling.samples_per_pixel", &S::samples_per_pixel, "samples", 1, 64, "Visibility samples per pixel; the same as --spp."},
      {"sampling.seed", &S::seed, "", 0, 4294967295.0, "Chooses among equally good sample patterns; the same as --seed."},
      {"sampling.temporal_pattern", &S::temporal_pattern, {"8x8", "32x32"},
       "Pixels after which the pattern of sample times repeats; the larger one shows less of itself and is slower to replay."},
      {"sampling.time_bits", &S::time_bits, {"8", "16"}, "Precision of a sample's time; the stencil unit sees the upper 8 bits."},
      {"tessellation.target_edge_pixels", &S::target_edge_pixels, "pixels", 0.25, 64,
       "Wanted length on screen of the sides of tessellated cells; smaller is more exact and slower."},
      {"shading.rate", &S::shading_rate, {"pixel", "sample", "cache"},
       "Runs of the pixel shader: once per pixel and surface (multisampling), once per visible sample, or once per cell of the surface about a pixel wide, "
       "while the shading cache holds it."},
      {"shading.cell_pixels", &S::shading_cell_pixels, "pixels", 0.125, 16,
       "With shading.rate=cache: wanted width of a shading cell on screen; smaller is sharper and slower."},
      {"effects.motion", &S::motion, {"auto", "on", "off"},
       "Motion blur: what the capture asks for; the general kernels everywhere (same picture); none."},
      {"effects.defocus", &S::defocus, {"auto", "on", "off"},
       "Defocus blur: what the capture's lens asks for; the general kernels everywhere (same picture); none."},
      {"output.machine_model", &S::machine_model,
       "Whether texture caches, cycles and energy are modelled; without, their counters and the members timing and energy are absent."},
      {"output.exposure", &S::exposure, "", 0, 1e6, "Factor on light before the PNG's tone map; 0 takes the capture's."},
  });
  return table;
}

nlohmann::json settings_json(const RunSettings& settings) {
  nlohmann::json out = nlohmann::json::object();
  for (const auto& key : settings_keys().keys()) out[std::string(key.name)] = key_value_json(settings_keys().value(settings, key));
  return out;
}

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> known;
    for (const auto& k : settings_keys().keys()) known.emplace_back(k.name);
    for (const auto& k : hardware::gpu_keys().keys()) known.emplace_back(k.name);
    return known;
  }();
  return kKnown;
}

void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings, hardware::GpuConfiguration& gpu) {
  if (const auto* key = settings_keys().find(name)) settings_keys().set(settings, *key, value);
  else if (const auto* gpu_key = hardware::gpu_keys().find(name)) hardware::gpu_keys().set(gpu, *gpu_key, value);
  else throw UsageError(unknown_key_message(name, known_keys()));
}

void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw UsageError(fmt::format("--set {}: expected KEY=VALUE", escape_control(text, 80)));
  set_key(text.substr(0, equals), text.substr(equals + 1), settings, gpu);
}

}  // namespace tessera::replay
