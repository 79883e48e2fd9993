#pragma once

#include <array>
#include <cstdint>

#include "base/real.h"
#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/texture.h"

namespace tessera::shaders {

// Comparisons of a lookup with the depths of a map: with the nearest texel; with the four around, weighted
// bilinearly; or with a box of three by three of these.
enum class ShadowFilter : std::uint8_t { kNearest, k2x2, k3x3 };

// One map of a light in the form that lookups read.
struct ShadowLayer {
  // Matrices on (xh, yh, depth, 1) from the camera's raster space to the map's in texels, at both keys of the camera's motion.
  std::array<Mat4, 2> from_raster{Mat4(1.0f), Mat4(1.0f)};
  // The same at the time of the map, for surfaces that do not move in the raster: they rest, or move with the camera.
  Mat4 from_resting{1.0f};
  float bias = 0;  // depth, added to the slope's bias
};

// The maps of a light at one time of the shutter, layer by layer in squares of `size` rows and columns: the depth
// nearest to the light at the centre of each texel, infinity where there is no surface.
struct ShadowView {
  const float* texels = nullptr;
  // If known without maps, the share of the light's rays that arrive, lane by lane. A light with neither member casts no shadows.
  const float* shares = nullptr;
  int size = 0, layers = 0;
  int times = 1;        // number of times at which the light has maps; their maps follow each other
  int first_layer = 0;  // number of the light's maps before these
  // Time at which moving receivers are looked up: 0 to 1 between the keys of their motion, or beyond if they move in
  // a part of the shutter that the maps do not cover.
  float t = 0;
  bool perspective = false;
  ShadowFilter filter = ShadowFilter::k2x2;
  float slope_bias = 0;  // share of the receiver's slope, which is depth per texel along both axes together
  float max_slope = 0;   // limit of the slope; in perspective for a receiver at depth 1
  const ShadowLayer* layer = nullptr;

  bool casts() const { return texels != nullptr || shares != nullptr; }
};

namespace scalar {
// clang-format off
#include "shaders_cpp/shadow_texels.inc"
#include "shaders_cpp/shadow_map.inc"
// clang-format on
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
