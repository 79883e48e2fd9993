#pragma once

#include <cmath>
#include <cstddef>

#include "scene/view.h"

namespace tessera::tilecore {

// Creases: where a surface bends within a block of 4x4 pixels, so that its shading jumps though depth does not. Normals
// follow from depth alone, those of the four squares of 2x2 pixels in the block's corners: 1/z of a plane is linear in
// the image, and its gradient is the plane's normal. Only blocks that the depth detector leaves, so that all depths are
// finite.
class CreaseDetector {
 public:
  CreaseDetector() = default;
  // `degrees` between two of the normals make a crease; 0: none does.
  CreaseDetector(double degrees, const scene::Projection& projection)
      : on_(degrees > 0),
        orthographic_(projection.orthographic),
        scale_(static_cast<float>(projection.scale)),
        center_x_(static_cast<float>(projection.center_x)),
        center_y_(static_cast<float>(projection.center_y)),
        cosine_(static_cast<float>(std::cos(degrees * 0.017453292519943295))) {}

  bool on() const { return on_; }
  // `depth` is that of the pixels of the whole block whose first pixel is (x, y) of the frame, with `stride` values from
  // row to row.
  bool detect(const float* depth, std::size_t stride, int x, int y) const;

 private:
  bool on_ = false, orthographic_ = false;
  float scale_ = 1, center_x_ = 0, center_y_ = 0, cosine_ = 1;
};

}  // namespace tessera::tilecore
