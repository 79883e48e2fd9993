#include "shaders_cpp/environment.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera::shaders {
namespace {

// A spherical Gaussian: amplitude * exp(sharpness * (dot(axis, direction) - 1)).
struct SoftBox {
  Vec3 axis;
  float sharpness;
  Vec3 amplitude;
};

const std::array<SoftBox, 3>& soft_boxes() {
  static const std::array<SoftBox, 3> kBoxes = {{
      {glm::normalize(Vec3(-0.55f, 0.75f, 0.65f)), 14.0f, Vec3(6.0f, 5.7f, 5.2f)},  // key, front left above
      {glm::normalize(Vec3(0.85f, 0.30f, 0.35f)), 10.0f, Vec3(1.3f, 1.45f, 1.7f)},  // fill, right
      {glm::normalize(Vec3(0.35f, 0.55f, -0.90f)), 18.0f, Vec3(3.2f, 3.3f, 3.6f)},  // rim, behind
  }};
  return kBoxes;
}

constexpr Vec3 kCeiling{0.62f, 0.66f, 0.72f};
constexpr Vec3 kFloor{0.20f, 0.185f, 0.17f};

// Ceiling over floor, mixed across a horizon of the given half-width.
Vec3 gradient(float height, float width) {
  const float t = std::clamp(0.5f + 0.5f * height / width, 0.0f, 1.0f);
  const float s = t * t * (3.0f - 2.0f * t);
  return kFloor * (1.0f - s) + kCeiling * s;
}

}  // namespace

Vec3 Environment::diffuse(Vec3 normal) const {
  Vec3 sum = gradient(normal.y, 1.0f);
  for (const SoftBox& box : soft_boxes()) {
    // Irradiance of a Gaussian lobe over pi: its integral 2*pi/sharpness, times a cosine that is softened because the
    // lobe is wide.
    const float cosine = glm::dot(normal, box.axis);
    const float soft = std::clamp((cosine + 0.25f) / 1.25f, 0.0f, 1.0f);
    sum += box.amplitude * (2.0f / box.sharpness * soft * soft);
  }
  return sum * intensity_;
}

Vec3 Environment::specular(Vec3 direction, float roughness) const {
  const float alpha = std::max(roughness * roughness, 0.02f);
  // The reflection lobe as a Gaussian of this sharpness; the convolution of two Gaussians is one again.
  const float lobe = 0.5f / (alpha * alpha);
  Vec3 sum = gradient(direction.y, 0.15f + 0.85f * roughness);
  for (const SoftBox& box : soft_boxes()) {
    const float share = lobe / (lobe + box.sharpness);
    sum += box.amplitude * (share * std::exp(box.sharpness * share * (glm::dot(direction, box.axis) - 1.0f)));
  }
  return sum * intensity_;
}

Vec3 Environment::background(Vec3 direction) const {
  return gradient(direction.y, 0.9f) * Vec3(0.62f, 0.66f, 0.72f) * (0.55f * intensity_);
}

}  // namespace tessera::shaders
