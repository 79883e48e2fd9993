#include "scene/tessellation_pattern.h"

#include <algorithm>
#include <cmath>

namespace tessera::scene {
namespace {

float polygon_length(const std::array<Vec4, 4>& points, float near_w) {
  std::array<Vec2, 4> screen;
  for (std::size_t i = 0; i < 4; ++i) screen[i] = Vec2(points[i]) / std::max(points[i].w, near_w);
  const auto side = [&](std::size_t i) {
    const Vec2 d = screen[i + 1] - screen[i];
    return std::sqrt(d.x * d.x + d.y * d.y);
  };
  // The outer two sides are added first: reversing the curve gives the same bits.
  return (side(0) + side(2)) + side(1);
}

}  // namespace

ParameterRange parameter_range(const TessellationPattern& p, const CellRange& r) {
  const bool stitched = (r.j0 == 0 && p.edge[0] != p.nu) || (r.j1 == p.nv && p.edge[1] != p.nu) ||
                        (r.i0 == 0 && p.edge[2] != p.nv) || (r.i1 == p.nu && p.edge[3] != p.nv);
  if (!stitched) {
    const auto nu = static_cast<float>(p.nu), nv = static_cast<float>(p.nv);
    return {static_cast<float>(r.i0) / nu, static_cast<float>(r.j0) / nv, static_cast<float>(r.i1) / nu,
            static_cast<float>(r.j1) / nv};
  }
  // Inner rows and columns lie on the regular grid, the outermost ones where their edges put them; parameters are
  // monotone along each, so the ends suffice. The rows next to the boundary count when the range has any.
  const int middle_i = std::min<int>(r.i0 + 1, r.i1), middle_j = std::min<int>(r.j0 + 1, r.j1);
  return {std::min({p.u(r.i0, r.j0), p.u(r.i0, middle_j), p.u(r.i0, r.j1)}),
          std::min({p.v(r.i0, r.j0), p.v(middle_i, r.j0), p.v(r.i1, r.j0)}),
          std::max({p.u(r.i1, r.j0), p.u(r.i1, middle_j), p.u(r.i1, r.j1)}),
          std::max({p.v(r.i0, r.j1), p.v(middle_i, r.j1), p.v(r.i1, r.j1)})};
}

int curve_factor(const std::array<std::array<Vec4, 4>, 2>& curve, float near_w, const TessellationSettings& settings,
                 int max_factor) {
  const float length = std::max(polygon_length(curve[0], near_w), polygon_length(curve[1], near_w));
  const double cells = std::ceil(static_cast<double>(length) / settings.target_edge_pixels);
  if (!(cells > 1.0)) return 1;  // NaN too
  return static_cast<int>(std::min(cells, static_cast<double>(max_factor)));
}

}  // namespace tessera::scene
