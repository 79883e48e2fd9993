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

Vec3 Environment::diffuse(Vec3 normal) const { return glm_vector(studio_diffuse(plain(normal), intensity_)); }

Vec3 Environment::specular(Vec3 direction, float roughness) const {
  return glm_vector(studio_specular(plain(direction), roughness, intensity_));
}

Vec3 Environment::background(Vec3 direction) const { return glm_vector(studio_background(direction.y, intensity_)); }

}  // namespace tessera::shaders
