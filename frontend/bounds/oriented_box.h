#pragma once

#include <array>
#include <span>

#include "base/vec.h"
#include "frontend/bounds/minmax_pyramid.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/tessellation_pattern.h"

namespace tessera::frontend {

using ControlNet = std::array<DVec3, 16>;  // c[4*j + i], i along u

// Control points of the part [u0, u1] x [v0, v1] of a patch (de Casteljau twice along each parameter).
ControlNet sub_net(const ControlNet& net, const ParameterRange& range);

// A box in an orthonormal frame, one extent per key: a linearly moving box in one frame.
struct MovingBox {
  std::array<DVec3, 3> axes;                // unit
  std::array<std::array<double, 3>, 2> low, high;  // [key][axis]
};

// OBB method (Munkberg et al. 2010): axes from the corners of the net, mean of both keys; extents of all control points
// (convex hull property), widened by the largest displacement in every direction. Degenerate corners give the world
// axes. Contains every point p(u,v,t) + d n for |n| <= 1 and d in `displacement`.
MovingBox bezier_box(const std::array<ControlNet, 2>& nets, const ValueRange& displacement);

// Axis-aligned box of points.
MovingBox point_box(std::span<const Vec3> key0, std::span<const Vec3> key1, std::span<const std::uint32_t> indices);

// Corners of the box in raster space; `to_raster` per key.
MovingCorners box_corners(const MovingBox& box, const std::array<Mat4, 2>& to_raster);

// What single-precision evaluation of a vertex inside the box may be off, as a margin for screen_bounds: the position
// (bicubic form, normal, displacement: below 64 roundings of terms no larger than the box's largest coordinate), its
// product with the matrix (4 terms), the perspective division, and the snap to the sub-pixel grid.
RoundingMargin vertex_rounding_margin(const MovingBox& box, const std::array<Mat4, 2>& to_raster);

}  // namespace tessera::frontend
