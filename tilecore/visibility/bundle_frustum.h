#pragma once

#include <array>

#include "base/rect.h"
#include "tilecore/visibility/cell_test.h"

namespace tessera::tilecore {

// The space of a tile's rays: (X, Y, Z) = ((x - center_x) w, (y - center_y) w, depth), with w the depth (perspective)
// or 1 (orthographic). Vertices move linearly in it whatever their rates on screen, and rays are lines with depth as
// their parameter. The shear by the tile's centre keeps the rays of a pinhole near the Z axis, where boxes are tight.
struct RaySpace {
  double center_x = 0, center_y = 0;  // pixels; multiples of 1/2
  bool orthographic = false;
  bool moving = false;
  double inverse_focus = 0;
  double lens_radius = 0;   // pixels per unit of the lens factor; 0 for a pinhole
  double sharp_radius = 0;  // pixels of defocus that vertices in focus lack; see VisibilitySettings
};

// A linearly moving box of that space: [key][axis], B(t) = (1-t) B(0) + t B(1). Rounded outwards.
struct MotionBox {
  std::array<std::array<float, 3>, 2> low, high;

  static MotionBox empty();
  bool is_empty() const { return low[0][2] > high[0][2]; }
  void merge(const MotionBox& o);  // key by key
};

// The rays of a rectangle of pixels against moving boxes (Clarberg and Burns, US 8791945): outside a plane n.p + d > 0.
// The box's corner farthest inside moves linearly, too, so one distance at each key decides.
//
// Each side of the rectangle is a pair of planes, through the two extreme points of the lens: at depth z the side of a
// lens point l lies at a z + l (1 - z/f), l in [-R, R]; a point outside both extremes is outside all of them.
//
// Distances are computed in single precision with a bound e = 6 u (|n_x p_x| + |n_z p_z| + |d|) of their rounding, by
// which boxes are moved inwards before anything is decided or solved: solving first and nudging the solution afterwards
// loses samples when motion is slow. Raises neither the invalid nor the divide-by-zero flag for finite boxes.
//
// Invariants (cited by the tests):
//   BF1  A box that meets a ray of the rectangle at some time is not outside.
//   BF2  times() holds every time at which the box meets such a ray.
class BundleFrustum {
 public:
  // Depth in [near, far]; far may be infinite.
  BundleFrustum(const RaySpace& space, const IntRect& pixels, float near, float far);

  // Tests the near and far plane from here on only if `root` may cross them (its farther corners decide).
  void drop_depth_planes(const MotionBox& root);

  // Whether an inner node's box is outside one plane at both motion keys. A box that is outside different planes at
  // different times passes.
  bool outside(const MotionBox& box) const;

  // All times at which a leaf's box may meet a ray; empty when low > high.
  struct Times {
    float low = 0, high = 1;
    bool empty() const { return low > high; }
  };
  Times times(const MotionBox& box) const;

 private:
  // Outside if sign * p[axis] + slope * p.z + offset > 0. Depth planes have no slope.
  struct Plane {
    std::size_t axis;
    float sign, slope, offset;
  };
  struct Distances {
    float open, close;  // at the keys, moved inwards
    bool outside() const { return open > 0 && close > 0; }
  };
  static Distances distances(const Plane& plane, const MotionBox& box);
  static Times inside_times(const Distances& distances);

  std::array<std::array<Plane, 2>, 4> sides_;
  std::size_t extremes_;  // planes a side: 1 for a pinhole
  std::array<Plane, 2> depth_;
  std::size_t first_depth_ = 0, depth_count_ = 0;
};

}  // namespace tessera::tilecore
