#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "base/rect.h"
#include "base/vec.h"
#include "scene/view.h"

namespace tessera::reference {

// The volume that the samples of a rectangle of pixels see at any time and through any point of the lens. In the space of
// ReferenceScene the ray of a sample is at depth z between
//   left * w - spread(z)   and   right * w + spread(z),   spread(z) = lens_scale * |1 - z / focus|, w = z or 1,
// and the same from top to bottom. Each side is a plane except for the spread. If two points lie on the wrong side of one
// plane, the straight line between them does as well; so triangles and their motion need only their vertices at both motion
// keys.
//
// Invariant (cited by the tests):
//   SRG1  If a region misses an object, no ray of its samples hits it, rounding included.
class SampleRegion {
 public:
  static constexpr std::size_t kAxes = 5;  // depth, then the distances inwards from left, right, top and bottom
  // One linear function of a point for each axis.
  using Axes = std::array<DVec4, kAxes>;
  // Interval of a set of points on every axis, rounding included.
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
  // A region that misses nothing.
  static SampleRegion everything(const scene::Projection& projection, const IntRect& pixels);

  const IntRect& pixels() const { return pixels_; }

  // The axes as functions of points that `to_space` transforms into ReferenceScene's space (rows: x, y, depth).
  Axes axes(const DMat4& to_space) const;
  void add(Extent& extent, const double* point) const;  // `point`: x, y, depth
  bool misses(const Extent& extent) const;
  // Whether the whole extent lies inside the region for every point of the lens.
  bool holds(const Extent& extent) const;

 private:
  IntRect pixels_;
  double left_, right_, top_, bottom_, near_, far_, lens_scale_, inverse_focus_;
  bool orthographic_, everything_ = false;
};

}  // namespace tessera::reference
