#include "shaders_cpp/environment.h"

#include <cmath>

namespace tessera::shaders {
namespace {

Vector3<float> plain(Vec3 a) { return {a.x, a.y, a.z}; }
Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

#include "shaders_cpp/background.inc"

}  // namespace

const std::array<Vec3, 3>& soft_box_axes() {
  static const std::array<Vec3, 3> kAxes = {glm::normalize(kSoftBoxes[0].axis), glm::normalize(kSoftBoxes[1].axis),
                                            glm::normalize(kSoftBoxes[2].axis)};
  return kAxes;
}

Vec3 Environment::diffuse(Vec3 normal) const { return glm_vector(surrounding_diffuse(surroundings_, plain(normal))); }

Vec3 Environment::specular(Vec3 direction, float roughness) const {
  return glm_vector(surrounding_specular(surroundings_, plain(direction), roughness));
}

Vec3 Environment::background(Vec3 direction) const {
  if (surroundings_.kind == Surroundings::Kind::kUniform) return Vec3(surroundings_.intensity);
  return glm_vector(studio_background(direction.y, surroundings_.intensity));
}

}  // namespace tessera::shaders
