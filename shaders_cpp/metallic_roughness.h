#pragma once

#include <cstddef>
#include <span>

#include "base/real.h"
#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/surroundings.h"

namespace tessera::shaders {

// Pixel shader of glTF's metallic-roughness material (glTF 2.0, appendix B): GGX distribution, height-correlated Smith
// visibility, Schlick's Fresnel, Lambert diffuse. All colours are linear light.

inline constexpr float kPi = 3.14159265358979323846f;
// Below this roughness the highlight of a point light is too small for single precision.
inline constexpr float kMinRoughness = 0.045f;

// A light of KHR_lights_punctual in world space.
struct Light {
  enum class Type { kDirectional, kPoint, kSpot };
  Type type = Type::kDirectional;
  Vec3 color{1.0f};  // linear, times intensity (lux, or candela for point and spot)
  Vec3 position{0.0f};
  Vec3 direction{0.0f, 0.0f, -1.0f};  // direction in which the light travels, unit
  float range = 0.0f;                 // 0 = unlimited
  float cos_inner = 1.0f, cos_outer = 0.0f;

  bool operator==(const Light&) const = default;
};

// Lights that may move: `open` at time 0, `close` at time 1, seen at time t. Without `close` they do not move.
struct Lights {
  std::span<const Light> open, close;
  float t = 0;
};

namespace scalar {
#include "shaders_cpp/metallic_roughness.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
