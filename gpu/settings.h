#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/exr_file.h"
#include "base/key_table.h"
#include "gpu/configuration.h"
#include "scene/shadow_settings.h"
#include "scene/tessellation_settings.h"
#include "scene/texture_settings.h"
#include "tilecore/procedural/procedure_settings.h"
#include "tilecore/resolve/resolve_settings.h"
#include "tilecore/shading/shading_settings.h"
#include "tilecore/visibility/pattern_settings.h"

namespace tessera::gpu {

// Use of an effect: on request of the capture; the general kernels everywhere (same image); never.
enum class EffectMode : std::uint8_t { kAuto, kOn, kOff };
// Use of an effect without general kernels: on request of the capture, or never.
enum class EffectSwitch : std::uint8_t { kAuto, kOff };

// Keys effects.*.
struct EffectSettings {
  EffectMode motion = EffectMode::kAuto;
  EffectMode defocus = EffectMode::kAuto;
  EffectMode displacement = EffectMode::kAuto;
  EffectMode alpha_test = EffectMode::kAuto;
  EffectSwitch blending = EffectSwitch::kAuto;
  EffectSwitch procedures = EffectSwitch::kAuto;
  scene::ShadowCasters shadows = scene::ShadowCasters::kAuto;
};

// Keys stereo.*.
struct StereoSettings {
  double eye_separation = 0;  // 0: one eye
  double far_depth = 10;
};

// Keys post.*.
struct PostSettings {
  double bloom = 0.15;   // share of a pixel's light that a bloom spreads
  int bloom_levels = 0;  // 0: the capture's
  double taa = 0.1;      // share of the new frame in temporal antialiasing; 0: none
};

// Keys output.*.
struct OutputSettings {
  bool machine_model = true;
  double exposure = 0;  // 0: the capture's
};

// A user's choices about a replay, besides the described machine: the settings of the units that have some.
struct RunSettings {
  tilecore::PatternSettings sampling;
  scene::TessellationSettings tessellation;
  scene::TextureSettings textures;
  tilecore::ShadingSettings shading;
  EffectSettings effects;
  scene::ShadowSettings shadows;
  tilecore::ProcedureSettings procedures;
  tilecore::ResolveSettings resolve;
  StereoSettings stereo;
  PostSettings post;
  OutputSettings output;
};

const KeyTable<RunSettings>& settings_keys();
nlohmann::json settings_json(const RunSettings& settings);

// Sets the key in whichever of the two has it; a former name sets the key that replaced it, and leaves a note in
// gpu.key_notes. Throws UsageError for an unknown key (naming the nearest known one) or a value out of range.
void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings, GpuConfiguration& gpu);

// All keys that set_key knows.
const std::vector<std::string>& known_keys();

// Applies "KEY=VALUE", or "KEY=xFACTOR" for numbers of the machine, to whichever of the two has the key. Throws
// UsageError for a text without "=", an unknown key (naming the nearest known one) or a value out of range.
void apply_setting(const std::string& text, RunSettings& settings, GpuConfiguration& gpu);

}  // namespace tessera::gpu

namespace tessera {

template <>
inline constexpr auto kEnumWords<gpu::EffectMode> = std::to_array<std::string_view>({"auto", "on", "off"});
template <>
inline constexpr auto kEnumWords<gpu::EffectSwitch> = std::to_array<std::string_view>({"auto", "off"});

}  // namespace tessera
