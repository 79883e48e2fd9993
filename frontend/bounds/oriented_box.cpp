#include "frontend/bounds/oriented_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::frontend {
namespace {

double largest_of_box(const MovingBox& box) {
  double largest = 0;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      largest = std::max({largest, std::abs(box.low[key][axis]), std::abs(box.high[key][axis])});
  return largest * std::sqrt(3.0);
}

}  // namespace

MovingBox empty_box(const std::array<DVec3, 3>& axes) {
  MovingBox box;
  box.axes = axes;
  for (std::size_t key = 0; key < 2; ++key) {
    box.low[key].fill(std::numeric_limits<double>::infinity());
    box.high[key].fill(-std::numeric_limits<double>::infinity());
  }
  return box;
}

MovingBox point_box(std::span<const Vec3> key0, std::span<const Vec3> key1, std::span<const std::uint32_t> indices) {
  MovingBox box = empty_box({DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)});
  // The smallest and largest values along the axes come from the floats; points that do not deform are read once.
  const auto bound = [&](std::span<const Vec3> points, std::size_t key) {
    Vec3 low(std::numeric_limits<float>::infinity()), high = -low, zero(0.0f);
    for (const std::uint32_t index : indices) {
      const Vec3& p = points[index];
      low = glm::min(low, p), high = glm::max(high, p);
      zero += p * 0.0f;  // NaN where a coordinate is not finite
    }
    for (int axis = 0; axis < 3; ++axis) {
      // Such a box is unusable rather than too small.
      const double spoiled = static_cast<double>(zero.x + zero.y + zero.z);
      box.low[key][static_cast<std::size_t>(axis)] = static_cast<double>(low[axis]) + spoiled;
      box.high[key][static_cast<std::size_t>(axis)] = static_cast<double>(high[axis]) + spoiled;
    }
  };
  bound(key0, 0);
  if (key1.data() != key0.data())
    bound(key1, 1);
  else
    box.low[1] = box.low[0], box.high[1] = box.high[0];
  return box;
}

MovingCorners box_corners(const MovingBox& box, const std::array<Mat4, 2>& to_raster) {
  return corners_of_box(box, {DMat4(to_raster[0]), DMat4(to_raster[1])});
}

RoundingMargin vertex_rounding_margin(const MovingBox& box, double largest_control_point,
                                      const std::array<DMat4, 2>& to_raster, double subpixels) {
  constexpr double kUnit = 0x1p-24, kRoundings = 64 + 8;
  const double reach = std::max(largest_of_box(box), largest_control_point * std::sqrt(3.0));
  const std::array<double, 4> row = largest_terms(to_raster, reach);
  RoundingMargin margin;
  margin.position = kRoundings * kUnit * std::max(row[0], row[1]);
  margin.depth = kRoundings * kUnit * row[2];
  margin.w = kRoundings * kUnit * row[3];
  margin.pixels = 1.0 / subpixels;
  return margin;
}

RoundingMargin vertex_rounding_margin(const MovingBox& box, double largest_control_point,
                                      const std::array<Mat4, 2>& to_raster, double subpixels) {
  const std::array<DMat4, 2> exact = {DMat4(to_raster[0]), DMat4(to_raster[1])};
  return vertex_rounding_margin(box, largest_control_point, exact, subpixels);
}

}  // namespace tessera::frontend
