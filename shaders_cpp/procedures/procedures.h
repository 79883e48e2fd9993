#pragma once

#include <array>
#include <string_view>
#include <type_traits>

#include "base/vector3.h"
#include "shaders_cpp/procedures/declarations.h"
#include "shaders_cpp/procedures/program.h"
#include "shaders_cpp/procedures/scalar.h"
#include "shaders_cpp/procedures/uniforms.h"

// Procedures over Real (US 2007/0002066): shapes, textures and shading models as templates, for float, double, Dual and
// counting numbers. procedures-inl.h compiles the same text for SIMD lanes; Enclosure (frontend) has its own functions.

#define TESSERA_STAGE_ATTR  // attribute of lambdas for the SIMD target; empty here
#define TESSERA_STAGE_NOINLINE [[gnu::noinline]]

namespace tessera::shaders {

#include "shaders_cpp/procedures/functions.inc"

inline void real_sincos_turns(float turns, float& sine, float& cosine) { sincos_by_series(turns, sine, cosine); }
void real_sincos_turns(double turns, double& sine, double& cosine);

PlaneNoise<float> plane_noise_with_slopes(float x, float y);
PlaneNoise<double> plane_noise_with_slopes(double x, double y);
inline float plane_noise(float x, float y) { return plane_noise_with_slopes(x, y).value; }
inline double plane_noise(double x, double y) { return plane_noise_with_slopes(x, y).value; }

// Value noise in space, smooth, in [-1, 1]; for textures.
float space_noise(float x, float y, float z);

// Bilinear value of a plane of a geometry image at (u, v) in [0, 1]^2, and its slopes. Outside, the border continues.
PlaneNoise<float> image_value_with_slopes(const float* values, int width, int height, float u, float v);
PlaneNoise<double> image_value_with_slopes(const float* values, int width, int height, double u, double v);
inline float image_value(const float* values, int width, int height, float u, float v) {
  return image_value_with_slopes(values, width, height, u, v).value;
}
inline double image_value(const float* values, int width, int height, double u, double v) {
  return image_value_with_slopes(values, width, height, u, v).value;
}

// Each file needs the files before it.
// clang-format off
#include "shaders_cpp/procedures/dual.inc"
#include "shaders_cpp/procedures/shapes.inc"
#include "shaders_cpp/procedures/textures.inc"
#include "shaders_cpp/procedures/shading.inc"
#include "shaders_cpp/procedures/program.inc"
// clang-format on

#include "shaders_cpp/procedures/stages.inc"

}  // namespace tessera::shaders

#undef TESSERA_STAGE_ATTR
#undef TESSERA_STAGE_NOINLINE
