#pragma once

#include <cstdint>

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/studio.h"

namespace tessera::shaders {

// The image of an environment (environment_map.h). Its levels are lobes: level 0 is the mirror's, level 1 has the
// roughness below, and each further level is twice as wide as the one before, up to roughness 1. Each level has this
// share of the map's side within its border.
struct EnvironmentMap;
inline constexpr int kMapLevels = 9;
inline constexpr float kFirstMapRoughness = 0.088388348f;  // 2^(-7/2)
inline constexpr float kMapInside = 32.0f / 34.0f;

// The light from all around, in the form of scalar registers. Its kind is known when a shader is compiled.
struct Surroundings {
  enum class Kind : std::uint8_t {
    kStudio,   // studio.h
    kUniform,  // the same radiance from all directions: a furnace
    kImage
  };
  Kind kind = Kind::kStudio;
  float intensity = 1.0f;  // factor on the radiance; for a uniform environment the radiance itself
  const EnvironmentMap* image = nullptr;

  bool operator==(const Surroundings&) const = default;
};

namespace scalar {
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
