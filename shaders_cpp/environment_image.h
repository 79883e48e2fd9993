#pragma once

#include <cstdint>

#include "base/image.h"
#include "shaders_cpp/environment_map.h"
#include "shaders_cpp/radiance_image.h"

namespace tessera::shaders {

// An equirectangular image of what lies all around, prefiltered for lookups (environment_map.inc).
//
// Directions are those of three.js' EquirectangularReflectionMapping: a world direction (x, y, z) of unit length is seen
// at column (atan2(z, x) / (2 pi) + 1/2) * width and row (1/2 - asin(y) / pi) * height: +x in the middle, +y at the top.
//
// Level 0 has about as many texels as the image, kMinSide to kMaxSide a side. The others hold the image through GGX
// lobes seen head-on, shadowing included, as the built-in studio's rows do; between them lookups are linear. [measured]
// Half of what the mixed lobe and the true one differ by, over all directions, is at most 0.045, and 0.028 from roughness
// 0.5 on: of a scene between 0 and 1 no more is wrong. Light on diffuse surfaces is what nine spherical harmonics hold
// (Ramamoorthi and Hanrahan 2001): exact for slow changes, of a single distant light at most 9.4 % of the largest
// irradiance wrong; below zero it is zero.
//
// Invariants (cited by the tests):
//   ENV1  A constant image gives that constant in every direction, through every lobe and on every diffuse surface.
//   ENV2  Texels of a level's border are those that lie behind the octahedron's edge: lookups are continuous.
//   ENV3  The same image gives the same bits for any number of threads.
class EnvironmentImage : public EnvironmentMap {
 public:
  static constexpr int kMinSide = 64, kMaxSide = 1024;  // of level 0 without its border

  // `image`: at least three channels, twice as wide as high; what is negative or no number counts as 0, what is larger
  // than RadianceImage::kLargest as that. `rotation`: radians by which it is turned about +y, counterclockwise seen
  // from above.
  EnvironmentImage(Image image, double rotation);
  EnvironmentImage(const EnvironmentImage&) = delete;
  EnvironmentImage& operator=(const EnvironmentImage&) = delete;

  const RadianceImage& levels() const { return levels_; }
  int source_width() const { return source_width_; }

  // Memory that making it takes at most, besides the image.
  static std::uint64_t working_bytes(int source_height);

 private:
  RadianceImage levels_;
  int source_width_;
};

}  // namespace tessera::shaders
