#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>

#include "base/vec.h"
#include "scene/view.h"

namespace tessera::frontend {

// Screen bounds of a moving, defocused convex body, over the whole shutter and the whole lens.
struct ScreenBounds {
  float x0, y0, x1, y1;  // pixels, closed
  float grow;            // pixels by which the bounds exceed the hull of the projected points: lens and rounding
  float near_z, far_z;   // depth range of the part that is drawn
  bool crosses_near;     // some of it lies nearer than the near plane at some time
};

inline bool outside_frame(const ScreenBounds& b, int width, int height) {
  return b.x1 < 0 || b.y1 < 0 || b.x0 > static_cast<float>(width) || b.y0 > static_cast<float>(height);
}

// Corners of a linearly moving box in raster space (xh, yh, depth, w): eight at key 0, then eight at key 1.
using MovingCorners = std::array<DVec4, 16>;

// Bounds of the hull of all points (the corners of a body at both motion keys), cut at the near plane. A point that moves
// linearly between a point of the body at key 0 and one at key 1 projects, at any time, into the hull of the two ends'
// projections, so the bounds hold at every time (screen-space motion itself is not linear).
//
// Returns nullopt when the body never lies inside the depth range. NaN anywhere yields bounds of the whole plane.
//
// The margin is the caller's bound on the rounding of vertices: absolute errors of xh and yh, of w and of depth, and
// pixels on top. If the error of w could exceed a quarter of w the bounds are the whole plane.
struct RoundingMargin {
  double position = 0, w = 0, depth = 0, pixels = 0;
};
std::optional<ScreenBounds> screen_bounds(std::span<const DVec4> points, const scene::Projection& projection,
                                          const RoundingMargin& margin);

// Box of projected points that grows point by point.
struct ScreenHull {
  static constexpr double kEmpty = std::numeric_limits<double>::infinity();
  double x0 = kEmpty, y0 = kEmpty, x1 = -kEmpty, y1 = -kEmpty;
  double near_z = kEmpty, far_z = -kEmpty, near_w = kEmpty;
  bool unusable = false;  // a coordinate was NaN or infinite

  void add(const DVec4& r) {
    const double inverse = 1 / r.w, x = r.x * inverse, y = r.y * inverse;
    // Zero unless something is NaN or infinite.
    if (!((x - x) + (y - y) + (r.z - r.z) == 0)) unusable = true;
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
    near_z = std::min(near_z, r.z);
    far_z = std::max(far_z, r.z);
    near_w = std::min(near_w, r.w);
  }
};
// The fast path for the common case: points that are finite, have finite projections, and lie no nearer than `near`.
// Returns false and leaves `hull` unchanged if a point does not, or if their number is no multiple of four.
bool hull_in_front(std::span<const DVec4> points, double near, ScreenHull& hull);

// Circle-of-confusion radius in pixels of a point at `depth` (> 0 unless orthographic).
double defocus_radius(const scene::Projection& projection, double depth);

}  // namespace tessera::frontend
