#include "frontend/bounds/patch_net.h"

#include <cmath>

namespace tessera::frontend {
namespace {

constexpr std::array<std::array<std::size_t, 4>, 4> kEdgePoints = {
    {{0, 1, 2, 3}, {12, 13, 14, 15}, {0, 4, 8, 12}, {3, 7, 11, 15}}};

}  // namespace

PatchNet make_net(std::span<const Vec3, 16> points) {
  PatchNet net;
  for (std::size_t k = 0; k < 16; ++k) {
    net.c[0][k] = static_cast<double>(points[k].x);
    net.c[1][k] = static_cast<double>(points[k].y);
    net.c[2][k] = static_cast<double>(points[k].z);
  }
  return net;
}

CornerFrame corner_frame(std::span<const PatchNet> keys) {
  DVec3 t(0.0), b(0.0);
  for (const PatchNet& net : keys) {
    const DVec3 c00 = net.point(0), c30 = net.point(3), c03 = net.point(12), c33 = net.point(15);
    t += (c30 - c00) + (c33 - c03);
    b += (c03 - c00) + (c33 - c30);
  }
  CornerFrame frame;
  // The three lengths do not wait for each other.
  const DVec3 n = glm::cross(t, b);
  const double t_inverse = 1 / glm::length(t), b_inverse = 1 / glm::length(b), n_length = glm::length(n);
  const double sine = n_length * t_inverse * b_inverse;
  // Also false for NaN, which zero and infinite lengths give.
  if (!(sine > kLeastFrameSine && n_length > 0 && std::isfinite(n_length))) return frame;
  const DVec3 tangent_u = t * t_inverse, z = n * (1 / n_length);
  return {{tangent_u, glm::cross(z, tangent_u), z}, tangent_u, b * b_inverse, sine, true};
}

std::array<std::array<double, 4>, 4> cubic_restriction(double a, double b) {
  // Row k holds the blossom's weights at (a,a,a), (a,a,b), (a,b,b), (b,b,b).
  std::array<std::array<double, 4>, 4> rows;
  for (std::size_t k = 0; k < 4; ++k) {
    const double r = k > 2 ? b : a, s = k > 1 ? b : a, t = k > 0 ? b : a;
    const double r1 = 1 - r, s1 = 1 - s, t1 = 1 - t;
    rows[k] = {r1 * s1 * t1, r * s1 * t1 + r1 * s * t1 + r1 * s1 * t, r * s * t1 + r * s1 * t + r1 * s * t, r * s * t};
  }
  return rows;
}

std::array<DVec3, 4> restrict_cubic(const std::array<DVec3, 4>& points,
                                    const std::array<std::array<double, 4>, 4>& rows) {
  std::array<DVec3, 4> out;
  for (std::size_t k = 0; k < 4; ++k)
    out[k] = (points[0] * rows[k][0] + points[1] * rows[k][1]) + (points[2] * rows[k][2] + points[3] * rows[k][3]);
  return out;
}

std::array<DVec3, 4> edge_points(const PatchNet& net, std::size_t edge) {
  std::array<DVec3, 4> out;
  for (std::size_t k = 0; k < 4; ++k) out[k] = net.point(kEdgePoints[edge][k]);
  return out;
}

std::array<DVec3, 4> edge_across(const PatchNet& net, std::size_t edge) {
  // From the edge's row or the one before it to the next, in the order of the parameter.
  const std::size_t step = edge < 2 ? 4 : 1;
  const bool far = edge == 1 || edge == 3;
  std::array<DVec3, 4> out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t at = kEdgePoints[edge][k];
    out[k] = far ? net.point(at) - net.point(at - step) : net.point(at + step) - net.point(at);
  }
  return out;
}

}  // namespace tessera::frontend
