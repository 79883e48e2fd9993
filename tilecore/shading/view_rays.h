#pragma once

#include <array>
#include <cstddef>

#include "scene/frame_geometry.h"
#include "shaders_cpp/surroundings.h"
#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// World-space directions from points of the image into the scene, along which the background is seen. If the camera
// turns during the shutter, infinitely far points move linearly in raster space between the motion keys, as the scene's
// points do.
class ViewRays {
 public:
  explicit ViewRays(const scene::FrameGeometry& frame);

  // Point of the image in pixels; time in [0, 1]; point of the lens in Projection::lens_scale. Unit length.
  Vec3 direction(float x, float y, float t, float lens_u, float lens_v) const;

  // Whether the camera turns during the shutter.
  bool turning() const { return turning_; }

  // Arguments of direction(), point by point. Arrays reach to the next multiple of 16.
  struct Points {
    const float *x, *y, *t, *lens_u, *lens_v;
  };
  // Environment(around).background(direction()) of each of `count` points, with the same bits, on SIMD lanes. `colors`
  // reaches to the next multiple of 16, too. Lookups in an image use the slot kMirrored.
  void background(const Points& points, std::size_t count, const shaders::Surroundings& around,
                  const LookupArrays& lookups, Vec3* colors) const;

 private:
  friend struct ViewRaysKernel;

  scene::Projection projection_;
  bool turning_ = false;
  // Camera to world, up to scale: constant, times t, times t^2. Only the first unless the camera turns.
  std::array<DMat3, 3> to_world_{DMat3(1.0), DMat3(0.0), DMat3(0.0)};
};

}  // namespace tessera::tilecore
