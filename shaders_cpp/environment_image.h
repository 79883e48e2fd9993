#pragma once

#include <cstdint>

#include "base/image.h"
#include "shaders_cpp/environment_map.h"
#include "shaders_cpp/radiance_image.h"

namespace tessera::shaders {

// An equirectangular image of the environment, prefiltered for lookups (environment_map.inc).
//
// Directions follow three.js' EquirectangularReflectionMapping: a world direction (x, y, z) of unit length is seen at
// column (atan2(z, x) / (2 pi) + 1/2) * width and row (1/2 - asin(y) / pi) * height: +x in the middle, +y at the top.
//
// Level 0 has about as many texels as the image, kMinSide to kMaxSide a side. The others hold the image through GGX
// lobes seen head-on, shadowing included, like the rows of the built-in studio; lookups between them are linear.
// [measured] Half of the difference between the mixed lobe and the true one, over all directions, is at most 0.045,
// and 0.028 from roughness 0.5 on; this bounds the error in a scene between 0 and 1. Nine spherical harmonics hold
// the light on diffuse surfaces (Ramamoorthi and Hanrahan 2001): they are exact for slow changes; for a single
// distant light the error is at most 9.4 % of the largest irradiance. Negative irradiance is set to zero.
// irradiance wrong; below zero it is zero.
//
// Invariants (cited by the tests):
//   ENV1  A constant image gives that constant in every direction, through every lobe and on every diffuse surface.
//   ENV2  Texels of a level's border equal the texels behind the octahedron's edge: lookups are continuous.
//   ENV3  The same image gives the same bits for any number of threads.
class EnvironmentImage : public EnvironmentMap {
 public:
  static constexpr int kMinSide = 64, kMaxSide = 1024;  // side of level 0 without its border

  // `image`: at least three channels, twice as wide as high; negative numbers and NaN count as 0, and
  // RadianceImage::kLargest is the limit. `rotation`: turn about +y in radians, counterclockwise seen from above.
  EnvironmentImage(Image image, double rotation);
  EnvironmentImage(const EnvironmentImage&) = delete;
  EnvironmentImage& operator=(const EnvironmentImage&) = delete;

  const RadianceImage& levels() const { return levels_; }
  int source_width() const { return source_width_; }

  // Upper bound of the memory for making it, besides the image.
  static std::uint64_t working_bytes(int source_height);

 private:
  RadianceImage levels_;
  int source_width_;
};

}  // namespace tessera::shaders
