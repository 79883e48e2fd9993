#include "gpu/settings.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/former_keys.h"
#include "base/text.h"
#include "gpu/relative_value.h"
#include "scene/pass_graph.h"

namespace tessera::gpu {

namespace {

Keys<EffectSettings> effect_keys() {
  using S = EffectSettings;
  return {
      {"effects.motion", &S::motion,
       "Motion blur: on request of the capture; with the general kernels everywhere (same image); never."},
      {"effects.defocus", &S::defocus,
       "Defocus blur: on request of the capture's lens; with the general kernels everywhere (same image); never."},
      {"effects.displacement", &S::displacement,
       "Displacement: where the capture's maps are not zero; wherever it has maps (same image); never."},
      {"effects.alpha_test", &S::alpha_test,
       "Alpha test: where a masked material may be transparent; all over it (same image); never, so that masked "
       "surfaces are opaque."},
      {"effects.blending", &S::blending,
       "Blending: on request of the capture; never, so that blended surfaces are opaque."},
      {"effects.procedures", &S::procedures, "Procedures: all of the capture's are drawn; none."},
      {"effects.shadows", &S::shadows,
       "Shadows: of the lights that the capture names; none; or of all lights, with four maps of 1024 texels a side "
       "for a directional one, and one map of that size for each direction that another light needs."},
  };
}

Keys<StereoSettings> stereo_keys() {
  using S = StereoSettings;
  return {
      {"stereo.eye_separation", &S::eye_separation, "scene units", 0, 1e6,
       "Renders a second image for a right eye this far to the right of the camera, which is the left eye; 0 is one "
       "eye."},
      {"stereo.far_depth", &S::far_depth, "scene units", 0, 1e9,
       "With desampling the right eye takes pixels from the left eye if both see farther than this."},
  };
}

Keys<PostSettings> post_keys() {
  using S = PostSettings;
  return {
      {"post.bloom", &S::bloom, "", 0, 1,
       "Share of a pixel's light that the bloom of a capture spreads around it; 0 leaves the passes of the bloom out."},
      {"post.bloom_levels", &S::bloom_levels, "", 0, scene::Attachment::kMaxLevels,
       "Levels of a bloom; 0 takes the number of levels of the capture's attachment."},
      {"post.taa", &S::taa, "", 0, 1,
       "Share of the new frame in the temporal antialiasing of a capture. The first frames behind a cut take more of "
       "it, as a mean of them all needs; 0 leaves the pass and the velocities out, and frames are not jittered."},
  };
}

Keys<OutputSettings> output_keys() {
  using S = OutputSettings;
  return {
      {"output.machine_model", &S::machine_model,
       "Whether texture caches, cycles and energy are modelled; without, their counters and the members timing and "
       "energy are absent."},
      {"output.exposure", &S::exposure, "", 0, 1e6,
       "Factor on light before the PNG's tone map; 0 takes the capture's."},
  };
}

}  // namespace

const KeyTable<RunSettings>& settings_keys() {
  static const KeyTable<RunSettings> table(Keys<RunSettings>()
                                               .add(&RunSettings::sampling, tilecore::pattern_keys())
                                               .add(&RunSettings::tessellation, scene::tessellation_keys())
                                               .add(&RunSettings::textures, scene::texture_keys())
                                               .add(&RunSettings::shading, tilecore::shading_keys())
                                               .add(&RunSettings::effects, effect_keys())
                                               .add(&RunSettings::shadows, scene::shadow_keys())
                                               .add(&RunSettings::procedures, tilecore::procedure_keys())
                                               .add(&RunSettings::resolve, tilecore::resolve_keys())
                                               .add(&RunSettings::stereo, stereo_keys())
                                               .add(&RunSettings::post, post_keys())
                                               .add(&RunSettings::output, output_keys()));
  return table;
}

nlohmann::json settings_json(const RunSettings& settings) {
  nlohmann::json out = nlohmann::json::object();
  for (const auto& key : settings_keys().keys())
    out[std::string(key.name)] = key_value_json(settings_keys().value(settings, key));
  return out;
}

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> known;
    for (const auto& k : settings_keys().keys()) known.emplace_back(k.name);
    for (const auto& k : gpu_keys().keys()) known.emplace_back(k.name);
    return known;
  }();
  return kKnown;
}

void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings, GpuConfiguration& gpu) {
  if (const FormerKey* former = find_former_key(name);
      former != nullptr && settings_keys().find(former->now) != nullptr) {
    set_key(std::string(former->now), value, settings, gpu);
    gpu.key_notes.push_back(former_key_note(*former));
  } else if (const auto* key = settings_keys().find(name)) {
    if (is_relative(value) && settings_keys().value(settings, *key).index() < 2)
      throw UsageError(
          fmt::format("{}: '{}': only numbers of the machine (tessera describe gpu) are set as multiples; "
                      "give the value itself",
                      name, escape_control(value.get<std::string>(), 80)));
    settings_keys().set(settings, *key, value);
  } else if (!set_gpu_key(name, value, gpu)) {
    throw UsageError(unknown_key_message(name, known_keys()));
  } else {
    gpu.set_keys.push_back(name);
  }
}

void apply_setting(const std::string& text, RunSettings& settings, GpuConfiguration& gpu) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UsageError(fmt::format("--set {}: expected KEY=VALUE", escape_control(text, 80)));
  set_key(text.substr(0, equals), text.substr(equals + 1), settings, gpu);
}

}  // namespace tessera::gpu
