#pragma once

#include <array>
#include <cstdint>

#include "base/real.h"
#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/texture.h"

namespace tessera::shaders {

// Which comparisons with the depths of a map a lookup takes: one with the nearest texel; four around, weighed
// bilinearly; or a box of three by three of these.
enum class ShadowFilter : std::uint8_t { kNearest, k2x2, k3x3 };

// One map of a light as lookups see it.
struct ShadowLayer {
  // From the camera's raster space, as a matrix on (xh, yh, depth, 1), to that of the map in texels, at both keys of the
  // camera's motion.
  std::array<Mat4, 2> from_raster{Mat4(1.0f), Mat4(1.0f)};
  // The same at the time of the map, for what is in one place of the raster all the time: it rests, or rides with the camera.
  Mat4 from_resting{1.0f};
  float bias = 0;  // depth, beside what slopes add
};

// The maps of a light at one time of the shutter, layer by layer in squares of `size` rows and columns: the depth of what is nearest to the light at
// the middle of a texel, infinity where nothing is.
struct ShadowView {
  const float* texels = nullptr;
  // Lane by lane, the share of the light's rays that arrive, where it is known without maps. With neither of these the
  // light casts no shadows.
  const float* shares = nullptr;
  int size = 0, layers = 0;
  int times = 1;        // of the light's views, which are one after the other
  int first_layer = 0;  // before these, of the light's maps
  // Where receivers that move are looked up: 0 to 1 between the keys of their motion, or beyond where they move by a part of
  // the shutter that the maps are not of.
  float t = 0;
  bool perspective = false;
  ShadowFilter filter = ShadowFilter::k2x2;
  float slope_bias = 0;  // share of the receiver's slope, depth per texel along both axes together
  float max_slope = 0;   // of it; in perspective, of a receiver at depth 1
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
