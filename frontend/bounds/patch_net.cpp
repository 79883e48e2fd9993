#include "frontend/bounds/patch_net.h"

#include <cmath>

namespace tessera::frontend {

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
  const double t_length = glm::length(t), b_length = glm::length(b);
  // Written so that NaN leaves the world's axes.
  if (!(t_length > 0 && b_length > 0 && std::isfinite(t_length) && std::isfinite(b_length))) return frame;
  const DVec3 tangent_u = t * (1 / t_length), tangent_v = b * (1 / b_length), n = glm::cross(tangent_u, tangent_v);
  const double n_length = glm::length(n);
  if (!(n_length > 1e-6)) return frame;
  const DVec3 z = n * (1 / n_length);
  return {{tangent_u, glm::cross(z, tangent_u), z}, tangent_u, tangent_v, true};
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

}  // namespace tessera::frontend
