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
      {"procedures.path", &S::procedures_path, {"sampled", "tessellated"},
       "How procedures are drawn: by the sampling controller, or as ordinary patches whose vertices the procedure evaluates."},
      {"procedures.maps", &S::procedures_maps, {"interval", "published"},
       "Sparse pass of the sampling controller: cells bounded by interval evaluation, or one tuple per cell and a padded radius."},
      {"procedures.scatter", &S::procedures_scatter, {"footprint", "point"},
       "What a sample writes: the sample points inside its footprint, or, as published, the sub-pixel it falls into (still objects only)."},
      {"procedures.style", &S::procedures_style, {"surface", "lines"}, "Shaded surfaces, or a drawing with lines along the parameters."},
      {"procedures.spacing", &S::procedures_spacing, "sub-pixels", 0.125, 64,
       "Samples are so dense that no footprint reaches farther than this from its middle; smaller is more exact and slower."},
      {"procedures.cell_pixels", &S::procedures_cell_pixels, "pixels", 1, 512, "Interval maps: cells of the parameter domain larger than this on screen are halved."},
      {"procedures.padding", &S::procedures_padding, "", 0, 16, "Published maps: padding of a cell's place on screen, in its radius."},
      {"procedures.sparse_spacing", &S::procedures_sparse_spacing, "sub-pixels", 0.5, 256, "Published maps: distance of the tuples of the sparse pass."},
      {"procedures.refill", &S::procedures_refill, "Look for holes between samples, tile by tile, and sample them again; for spacings too wide for the scatter."},
      {"procedures.lanes", &S::procedures_lanes, "lanes", 1, 1024, "Lanes of the emulated SIMD array."},
      {"output.exposure", &S::exposure, "", 0, 1e6, "Factor on light before the PNG's tone map; 0 takes the capture's."},
  });
  return table;
}

nlohmann::json settings_json(const RunSettings& settings) {
  nlohmann::json out = nlohmann::json::object();
  for (const auto& key : settings_keys().keys()) out[std::string(key.name)] = key_value_json(settings_keys().value(settings, key));
  return out;
}

tilecore::ProcedureSettings procedure_settings(const RunSettings& settings) {
  using S = tilecore::ProcedureSettings;
  S out;
  out.maps = settings.procedures_maps == "published" ? S::Maps::kPublished : S::Maps::kInterval;
  out.scatter = settings.procedures_scatter == "point" ? S::Scatter::kPoint : S::Scatter::kFootprint;
  out.style = settings.procedures_style == "lines" ? S::Style::kLines : S::Style::kSurface;
  out.spacing = settings.procedures_spacing;
  out.cell_pixels = settings.procedures_cell_pixels;
  out.padding = settings.procedures_padding;
  out.sparse_spacing = settings.procedures_sparse_spacing;
  out.refill = settings.procedures_refill;
  out.lanes = static_cast<int>(settings.procedures_lanes);
  return out;
}

void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw UsageError(fmt::format("--set {}: expected KEY=VALUE", escape_control(text, 80)));
  const std::string name = text.substr(0, equals), value = text.substr(equals + 1);
  if (const auto* key = settings_keys().find(name)) {
    settings_keys().set(settings, *key, value);
  } else if (const auto* gpu_key = hardware::gpu_keys().find(name)) {
    hardware::gpu_keys().set(gpu, *gpu_key, value);
  } else {
    std::vector<std::string> known;
    for (const auto& k : settings_keys().keys()) known.emplace_back(k.name);
    for (const auto& k : hardware::gpu_keys().keys()) known.emplace_back(k.name);
    throw UsageError(unknown_key_message(name, known));
  }
}

}  // namespace tessera::replay
