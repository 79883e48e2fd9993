#include "shaders_cpp/environment.h"

#include <algorithm>
#include <cmath>

#include "shaders_cpp/studio.h"

namespace tessera::shaders {
namespace {

const std::array<Vec3, 3>& box_axes() {
  static const std::array<Vec3, 3> kAxes = {glm::normalize(kSoftBoxes[0].axis), glm::normalize(kSoftBoxes[1].axis),
                                            glm::normalize(kSoftBoxes[2].axis)};
  return kAxes;
}

// The studio through the lobe that lies `weight` of the way from row `row` to the next one.
Vec3 studio(Vec3 direction, std::size_t row, float weight) {
  const EnvironmentLobes &a = kEnvironmentLobes[row], &b = kEnvironmentLobes[weight > 0.0f ? row + 1 : row];
  const auto mix = [&](float x, float y) { return x + weight * (y - x); };
  float ceiling = 0.5f + mix(a.slope, b.slope) * direction.y;
  for (std::size_t k = 0; k < kHorizonWidths.size(); ++k)
    ceiling += mix(a.horizon[k], b.horizon[k]) * (ceiling_share(direction.y, kHorizonWidths[k]) - 0.5f);
  Vec3 sum = kFloor * (1.0f - ceiling) + kCeiling * ceiling;
  for (std::size_t k = 0; k < kSoftBoxes.size(); ++k) {
    const LobeFit &from = a.box[k], &to = b.box[k];
    const float c = glm::dot(direction, box_axes()[k]);
    const float e = std::exp(mix(from.sharpness, to.sharpness) * (c - 1.0f));
    const float peak = e * (mix(from.broad, to.broad) + e * mix(from.narrow, to.narrow));
    const float share = peak + mix(from.constant, to.constant) +
                        c * (mix(from.linear, to.linear) + c * mix(from.quadratic, to.quadratic));
    sum += kSoftBoxes[k].amplitude * std::max(share, 0.0f);
  }
  return sum;
}

}  // namespace

Vec3 Environment::diffuse(Vec3 normal) const { return studio(normal, kDiffuseRow, 0.0f) * intensity_; }

Vec3 Environment::specular(Vec3 direction, float roughness) const {
  const float at = std::clamp(roughness, 0.0f, 1.0f) * static_cast<float>(kDiffuseRow - 1);
  const float row = std::floor(at);
  return studio(direction, static_cast<std::size_t>(row), at - row) * intensity_;
}

Vec3 Environment::background(Vec3 direction) const {
  const float ceiling = ceiling_share(direction.y, 0.9f);
  return (kFloor * (1.0f - ceiling) + kCeiling * ceiling) * Vec3(0.62f, 0.66f, 0.72f) * (0.55f * intensity_);
}

}  // namespace tessera::shaders
