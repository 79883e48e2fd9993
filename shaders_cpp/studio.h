#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/vec.h"

namespace tessera::shaders {

// The parts of the built-in environment. World directions, +y up; radiance in linear light.

// A spherical Gaussian: amplitude * exp(sharpness * (dot(axis, direction) - 1)).
struct SoftBox {
  Vec3 axis;  // not normalised
  float sharpness;
  Vec3 amplitude;
};
inline constexpr std::array<SoftBox, 3> kSoftBoxes = {{
    {{-0.55f, 0.75f, 0.65f}, 14.0f, {6.0f, 5.7f, 5.2f}},  // key, front left above
    {{0.85f, 0.30f, 0.35f}, 10.0f, {1.3f, 1.45f, 1.7f}},  // fill, right
    {{0.35f, 0.55f, -0.90f}, 18.0f, {3.2f, 3.3f, 3.6f}},  // rim, behind
}};
inline constexpr Vec3 kCeiling{0.62f, 0.66f, 0.72f}, kFloor{0.20f, 0.185f, 0.17f};
// Half-width of the horizon, as the height of a direction: floor below, ceiling above.
inline constexpr float kHorizon = 0.15f;

// Share of the ceiling at a height, across a horizon of the given half-width.
template <class Real>
Real ceiling_share(Real height, Real width) {
  const Real t = std::clamp(Real(0.5) + Real(0.5) * height / width, Real(0), Real(1));
  return t * t * (Real(3) - Real(2) * t);
}

// The parts of the environment as a surface of one roughness reflects them: convolved with the GGX lobe, shadowing
// included, that is seen head-on (normal, view and mirror direction are one, as in Karis 2013).
//   soft box   narrow e^2 + broad e + constant + linear c + quadratic c^2, with c the cosine to its axis and
//              e = exp(sharpness (c - 1))
//   ceiling    1/2 + sum of weight_k (ceiling_share(y, kHorizonWidths[k]) - 1/2) + slope y
struct LobeFit {
  float sharpness, narrow, broad, constant, linear, quadratic;
};
struct EnvironmentLobes {
  std::array<float, 4> horizon;
  float slope;
  std::array<LobeFit, 3> box;
};
inline constexpr std::array<float, 4> kHorizonWidths = {kHorizon, 0.3f, 0.6f, 1.2f};
// Roughness 0, 1/16, ... 1; then a diffuse surface.
inline constexpr std::size_t kDiffuseRow = 17;
extern const std::array<EnvironmentLobes, 18> kEnvironmentLobes;

// The same as plain numbers, row after row: four of the horizon, the slope, six of each box.
inline constexpr int kLobeFloats = 23;
static_assert(sizeof(EnvironmentLobes) == kLobeFloats * sizeof(float));
inline const float* lobe_numbers() { return reinterpret_cast<const float*>(kEnvironmentLobes.data()); }

// Normalised axes of kSoftBoxes.
const std::array<Vec3, 3>& soft_box_axes();

}  // namespace tessera::shaders
