#pragma once

#include <array>
#include <span>

#include "base/vec.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::frontend {

// A box in an orthonormal frame, one extent per key: a linearly moving box in one frame.
struct MovingBox {
  std::array<DVec3, 3> axes;                       // unit
  std::array<std::array<double, 3>, 2> low, high;  // [key][axis]
};

// An empty box.
MovingBox empty_box(const std::array<DVec3, 3>& axes);

// Axis-aligned box of points.
MovingBox point_box(std::span<const Vec3> key0, std::span<const Vec3> key1, std::span<const std::uint32_t> indices);

// Corners of the box in raster space; `to_raster` per key.
MovingCorners box_corners(const MovingBox& box, const std::array<Mat4, 2>& to_raster);
MovingCorners corners_of_box(const MovingBox& box, const std::array<DMat4, 2>& to_raster);

// Largest error of single-precision evaluation of a vertex inside the box, as a margin for screen_bounds: the position
// (bicubic form, normal, displacement: below 64 roundings of terms no larger than the largest coordinate of the box or
// of the control points), its product with the matrix (4 terms), the perspective division, and the snap to the
// sub-pixel grid, of `subpixels` steps a pixel.
RoundingMargin vertex_rounding_margin(const MovingBox& box, double largest_control_point,
                                      const std::array<DMat4, 2>& to_raster, double subpixels);
RoundingMargin vertex_rounding_margin(const MovingBox& box, double largest_control_point,
                                      const std::array<Mat4, 2>& to_raster, double subpixels);
// Largest sums of the terms of xh, yh, depth and w when the matrices of both keys transform coordinates no larger than
// `reach`.
std::array<double, 4> largest_terms(const std::array<DMat4, 2>& to_raster, double reach);

}  // namespace tessera::frontend
