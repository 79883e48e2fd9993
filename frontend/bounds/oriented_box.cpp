#include "frontend/bounds/oriented_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/subpixel.h"

namespace tessera::frontend {
namespace {

// The part [a, b] of a cubic, by two de Casteljau splits.
void restrict_cubic(DVec3& c0, DVec3& c1, DVec3& c2, DVec3& c3, double a, double b) {
  const auto blossom = [&](double r, double s, double t) {
    const auto mix = [](const DVec3& p, const DVec3& q, double w) { return p * (1 - w) + q * w; };
    const DVec3 p01 = mix(c0, c1, r), p12 = mix(c1, c2, r), p23 = mix(c2, c3, r);
    return mix(mix(p01, p12, s), mix(p12, p23, s), t);
  };
  const DVec3 d0 = blossom(a, a, a), d1 = blossom(a, a, b), d2 = blossom(a, b, b), d3 = blossom(b, b, b);
  c0 = d0, c1 = d1, c2 = d2, c3 = d3;
}

// Axes of a net from its corners, or the world axes when the corners do not span a plane.
std::array<DVec3, 3> corner_frame(const ControlNet& c) {
  const std::array<DVec3, 3> world = {DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
  const DVec3 t = (c[3] - c[0]) + (c[15] - c[12]), b = (c[12] - c[0]) + (c[15] - c[3]);
  const double t_length = glm::length(t), b_length = glm::length(b);
  if (!(t_length > 0 && b_length > 0 && std::isfinite(t_length) && std::isfinite(b_length))) return world;
  const DVec3 n = glm::cross(t / t_length, b / b_length);
  const double n_length = glm::length(n);
  if (!(n_length > 1e-6)) return world;
  const DVec3 x = t / t_length, z = n / n_length;
  return {x, glm::cross(z, x), z};
}

void extend(MovingBox& box, std::size_t key, const DVec3& p) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double s = glm::dot(box.axes[axis], p);
    // Negated comparisons: NaN enters the box and makes it unusable rather than vanish.
    if (!(s >= box.low[key][axis])) box.low[key][axis] = s;
    if (!(s <= box.high[key][axis])) box.high[key][axis] = s;
  }
}

MovingBox empty_box(const std::array<DVec3, 3>& axes) {
  MovingBox box;
  box.axes = axes;
  for (std::size_t key = 0; key < 2; ++key) {
    box.low[key].fill(std::numeric_limits<double>::infinity());
    box.high[key].fill(-std::numeric_limits<double>::infinity());
  }
  return box;
}

double largest_coordinate(const MovingBox& box) {
  double largest = 0;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      largest = std::max({largest, std::abs(box.low[key][axis]), std::abs(box.high[key][axis])});
  return largest * std::sqrt(3.0);
}

}  // namespace

ControlNet sub_net(const ControlNet& net, const ParameterRange& range) {
  ControlNet c = net;
  const double u0 = static_cast<double>(range.u0), u1 = static_cast<double>(range.u1);
  const double v0 = static_cast<double>(range.v0), v1 = static_cast<double>(range.v1);
  for (std::size_t j = 0; j < 4; ++j) restrict_cubic(c[4 * j], c[4 * j + 1], c[4 * j + 2], c[4 * j + 3], u0, u1);
  for (std::size_t i = 0; i < 4; ++i) restrict_cubic(c[i], c[i + 4], c[i + 8], c[i + 12], v0, v1);
  return c;
}

MovingBox bezier_box(const std::array<ControlNet, 2>& nets, const ValueRange& displacement) {
  ControlNet mean;
  for (std::size_t i = 0; i < 16; ++i) mean[i] = (nets[0][i] + nets[1][i]) * 0.5;
  MovingBox box = empty_box(corner_frame(mean));
  for (std::size_t key = 0; key < 2; ++key)
    for (const DVec3& p : nets[key]) extend(box, key, p);
  const double reach = std::max(std::abs(static_cast<double>(displacement.low)), std::abs(static_cast<double>(displacement.high)));
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[key][axis] -= reach;
      box.high[key][axis] += reach;
    }
  return box;
}

MovingBox point_box(std::span<const Vec3> key0, std::span<const Vec3> key1, std::span<const std::uint32_t> indices) {
  MovingBox box = empty_box({DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)});
  for (const std::uint32_t index : indices) {
    extend(box, 0, DVec3(key0[index]));
    extend(box, 1, DVec3(key1[index]));
  }
  return box;
}

MovingCorners box_corners(const MovingBox& box, const std::array<Mat4, 2>& to_raster) {
  MovingCorners corners;
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat4 m(to_raster[key]);
    for (std::size_t i = 0; i < 8; ++i) {
      DVec3 p(0.0);
      for (std::size_t axis = 0; axis < 3; ++axis)
        p += box.axes[axis] * ((i >> axis & 1) != 0 ? box.high[key][axis] : box.low[key][axis]);
      corners[8 * key + i] = m * DVec4(p, 1.0);
    }
  }
  return corners;
}

RoundingMargin vertex_rounding_margin(const MovingBox& box, const std::array<Mat4, 2>& to_raster) {
  constexpr double kUnit = 0x1p-24, kRoundings = 64 + 8;
  const double reach = largest_coordinate(box);
  std::array<double, 4> row{};  // largest sum of the terms of xh, yh, depth and w
  for (const Mat4& m : to_raster)
    for (int r = 0; r < 4; ++r) {
      double sum = std::abs(static_cast<double>(m[3][r]));
      for (int column = 0; column < 3; ++column) sum += std::abs(static_cast<double>(m[column][r])) * reach;
      row[static_cast<std::size_t>(r)] = std::max(row[static_cast<std::size_t>(r)], sum);
    }
  RoundingMargin margin;
  margin.position = kRoundings * kUnit * std::max(row[0], row[1]);
  margin.depth = kRoundings * kUnit * row[2];
  margin.w = kRoundings * kUnit * row[3];
  margin.pixels = 1.0 / static_cast<double>(kSubpixels);
  return margin;
}

}  // namespace tessera::frontend
