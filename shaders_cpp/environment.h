#pragma once

#include <concepts>

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/environment_map.h"
#include "shaders_cpp/surroundings.h"

namespace tessera::shaders {

// The light that every scene has unless its capture turns it off. The default is a studio of a bright ceiling, a
// darker floor and three soft boxes (studio.h); it is analytic, so it needs no image and can be blurred for any
// roughness. The alternatives are a uniform environment and an image (environment_image.h), which must outlive this.
//
// World directions, +y up. Radiance in linear light; 1 is the brightness of a white diffuse surface in full light.
class Environment {
 public:
  explicit Environment(float intensity = 1.0f) { surroundings_.intensity = intensity; }
  explicit Environment(const Surroundings& surroundings) : surroundings_(surroundings) {}

  // Light arriving at a surface with normal n, divided by pi (multiply by albedo).
  Vec3 diffuse(Vec3 normal) const;

  // Radiance around a direction, through the GGX lobe of the given perceptual roughness in [0, 1], seen head-on.
  Vec3 specular(Vec3 direction, float roughness) const;

  const Surroundings& surroundings() const { return surroundings_; }

  // Radiance that the camera sees where no surface is.
  Vec3 background(Vec3 direction) const;

  // Interface for shading one point (metallic_roughness.inc).
  template <std::same_as<float> Real>
  Vector3<Real> diffuse(const Vector3<Real>& normal) const {
    return light_on(normal);
  }
  Vector3<float> reflected(const Vector3<float>& direction, float roughness) const;
  Vector3<float> reflected_by_coat(const Vector3<float>& direction, float roughness) const {
    return reflected(direction, roughness);
  }

 private:
  Vector3<float> light_on(const Vector3<float>& normal) const;

  Surroundings surroundings_;
};

}  // namespace tessera::shaders
