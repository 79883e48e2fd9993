#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "gpu/resolve_sequence.h"
#include "gpu/settings.h"
#include "gpu/tile_maps.h"
#include "scene/frame_geometry.h"

namespace tessera::gpu {

struct FrameCounters;

// Whether an effect ran anywhere in a frame, by its name.
using FrameEffects = std::map<std::string, bool>;

// Places where an effect ran.
struct EffectPlaces {
  std::uint64_t sub_patches = 0;         // sent to the binner with it; for effects that the front end decides
  std::uint64_t sub_patches_elided = 0;  // of surfaces with the effect, but which need no code for it
  std::uint64_t tiles = 0;               // tiles in which it ran, views of a stereo pair together
};
using FrameEffectPlaces = std::map<std::string, EffectPlaces>;

// Places where effects of materials (scene::MaterialEffect) were drawn.
struct MaterialPlaces {
  std::array<std::uint64_t, scene::kMaterialEffectCount> sub_patches{};  // sent to the binner
  std::vector<scene::MaterialEffects> tiles;  // by tile: of the sub-patches in its lists; empty: no tile has any

  // Adds a further view of the same frame.
  void add(const MaterialPlaces& view);
};

// Sources of the description of a finished frame.
struct EffectSources {
  const scene::FrameGeometry& frame;  // of the left or only eye
  const RunSettings& settings;
  const FrameCounters& counters;
  const TileMaps& maps;
  const MaterialPlaces& materials;
  const shaders::EnvironmentImage* environment;  // nullptr if there is no image
  bool stereo, compressed;
};

// Adds to `effects`, `reasons` and `places` the effects of docs/shading.md; effects of the resolve unit that `effects`
// and `reasons` already hold stay as they are.
void report_effects(const EffectSources& from, FrameEffects& effects, EffectReasons& reasons,
                    FrameEffectPlaces& places);

}  // namespace tessera::gpu
