#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "base/rect.h"
#include "base/vec.h"
#include "scene/view.h"

namespace tessera::reference {

// Where the samples of a rectangle of pixels look, at any time and through any point of the lens. In the space of
// ReferenceScene a sample at depth z is between
//   left * w - spread(z)   and   right * w + spread(z),   spread(z) = lens_scale * |1 - z / focus|, w = z or 1,
// and the same from top to bottom. Each side is a plane but for the spread, and what lies on straight lines between
// points on the wrong side of one plane is there as well: triangles and their motion need no more than the vertices at
// both motion keys.
//
// Invariant (cited by the tests):
//   SRG1  What a region misses, no ray of its samples hits, rounding included.
class SampleRegion {
 public:
  static constexpr std::size_t kAxes = 5;  // depth, then the distances inwards from left, right, top and bottom
  // One linear function of a point for each axis.
  using Axes = std::array<DVec4, kAxes>;
  // Interval on every axis of some points, rounding included.
  struct Extent {
    std::array<double, kAxes> low, high;
    Extent() {
      low.fill(std::numeric_limits<double>::infinity());
      high.fill(-std::numeric_limits<double>::infinity());
    }
    void add(std::size_t axis, double least, double most) {
      low[axis] = least < low[axis] ? least : low[axis];
      high[axis] = most > high[axis] ? most : high[axis];
    }
  };

  SampleRegion(const scene::Projection& projection, const IntRect& pixels);
  // One that misses nothing.
  static SampleRegion everything(const scene::Projection& projection, const IntRect& pixels);

  const IntRect& pixels() const { return pixels_; }

  // The axes as functions of points that `to_space` brings into ReferenceScene's space (rows: x, y, depth).
  Axes axes(const DMat4& to_space) const;
  void add(Extent& extent, const double* point) const;  // x, y, depth
  bool misses(const Extent& extent) const;
  // Whether all is in the middle of it, whatever the lens: no part of it is missed.
  bool holds(const Extent& extent) const;

 private:
  IntRect pixels_;
  double left_, right_, top_, bottom_, near_, far_, lens_scale_, inverse_focus_;
  bool orthographic_, everything_ = false;
};

}  // namespace tessera::reference
