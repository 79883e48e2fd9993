#pragma once

#include <cstdint>

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/studio.h"

namespace tessera::shaders {

// An image of what lies all around: environment_map.h. Its levels are lobes; the roughness of the first but the mirror's,
// from which on each is twice as wide as the one before, up to roughness 1. Within its border each level has this share
// of the map's side.
struct EnvironmentMap;
inline constexpr int kMapLevels = 9;
inline constexpr float kFirstMapRoughness = 0.088388348f;  // 2^(-7/2)
inline constexpr float kMapInside = 32.0f / 34.0f;

// What lights surfaces from all around, as scalar registers hold it. Which kind it is is known when a shader is
// compiled.
struct Surroundings {
  enum class Kind : std::uint8_t {
    kStudio,   // studio.h
    kUniform,  // the same radiance from everywhere: a furnace
    kImage
  };
  Kind kind = Kind::kStudio;
  float intensity = 1.0f;  // factor on all of it; the radiance of a uniform one
  const EnvironmentMap* image = nullptr;

  bool operator==(const Surroundings&) const = default;
};

namespace scalar {
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
