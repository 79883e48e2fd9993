#pragma once

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/studio.h"

namespace tessera::shaders {

namespace scalar {
#include "shaders_cpp/studio_light.inc"
}  // namespace scalar
using namespace scalar;

// The light that every scene has unless its capture turns it off: a studio of a bright ceiling, a darker floor and
// three soft boxes (studio.h), analytic so that it needs no image and can be blurred as much as a rough surface asks.
// World directions, +y up. Radiance in linear light; 1 is the brightness of a white diffuse surface in full light.
class Environment {
 public:
  explicit Environment(float intensity = 1.0f) : intensity_(intensity) {}

  // Light arriving at a surface with normal n, divided by pi (multiply by albedo).
  Vec3 diffuse(Vec3 normal) const;

  // Radiance from around a direction, through the GGX lobe of the given perceptual roughness in [0, 1], seen head-on.
  Vec3 specular(Vec3 direction, float roughness) const;

  float intensity() const { return intensity_; }

  // What the camera sees behind everything.
  Vec3 background(Vec3 direction) const;

 private:
  float intensity_;
};

}  // namespace tessera::shaders
