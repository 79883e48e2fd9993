#include "shaders_cpp/environment.h"

#include <cmath>

namespace tessera::shaders {
namespace {

Vector3<float> plain(Vec3 a) { return {a.x, a.y, a.z}; }
Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

}  // namespace

const std::array<Vec3, 3>& soft_box_axes() {
  static const std::array<Vec3, 3> kAxes = {glm::normalize(kSoftBoxes[0].axis), glm::normalize(kSoftBoxes[1].axis),
                                            glm::normalize(kSoftBoxes[2].axis)};
  return kAxes;
}

Vector3<float> Environment::light_on(const Vector3<float>& normal) const {
  if (surroundings_.kind == Surroundings::Kind::kImage)
    return environment_diffuse(*surroundings_.image, normal) * surroundings_.intensity;
  return surrounding_diffuse(surroundings_, normal);
}

Vector3<float> Environment::reflected(const Vector3<float>& direction, float roughness) const {
  LookupTexels<std::int32_t> read;
  if (surroundings_.kind == Surroundings::Kind::kImage)
    return environment_specular(*surroundings_.image, direction, roughness, read) * surroundings_.intensity;
  return surrounding_specular(surroundings_, direction, roughness);
}

Vec3 Environment::diffuse(Vec3 normal) const { return glm_vector(light_on(plain(normal))); }

Vec3 Environment::specular(Vec3 direction, float roughness) const {
  return glm_vector(reflected(plain(direction), roughness));
}

Vec3 Environment::background(Vec3 direction) const {
  if (surroundings_.kind == Surroundings::Kind::kStudio)
    return glm_vector(studio_background(direction.y, surroundings_.intensity));
  return specular(direction, 0.0f);
}

}  // namespace tessera::shaders
