#include "scene/tessellation_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// Searches the triangle that holds a point best: the one whose least weight is largest, at most zero.
class TriangleSearch {
 public:
  TriangleSearch(const TessellationPattern& pattern, float u, float v) : pattern_(pattern), u_(u), v_(v) {}

  void look_at_cell(int i, int j) {
    if (least_ >= 0) return;
    const auto number = static_cast<std::uint32_t>(2 * (j * pattern_.nu + i));
    const Vec2 a = vertex(i, j), c = vertex(i + 1, j + 1);
    look_at(number, a, vertex(i + 1, j), c);
    look_at(number + 1, a, c, vertex(i, j + 1));
  }
  GridPoint found() const { return found_; }

 private:
  Vec2 vertex(int i, int j) const { return {pattern_.u(i, j), pattern_.v(i, j)}; }

  void look_at(std::uint32_t number, Vec2 a, Vec2 b, Vec2 c) {
    const Vec2 ab = b - a, ac = c - a, at = Vec2(u_, v_) - a;
    const float area = ab.x * ac.y - ab.y * ac.x;
    if (!(area > 0)) return;  // vertices of an edge coincide
    const float b1 = (at.x * ac.y - at.y * ac.x) / area, b2 = (ab.x * at.y - ab.y * at.x) / area;
    const float least = std::min({b1, b2, 1.0f - b1 - b2, 0.0f});
    if (!(least > least_)) return;
    least_ = least;
    const float x = std::max(b1, 0.0f), y = std::max(b2, 0.0f), over = std::max(x + y, 1.0f);
    found_ = {number, x / over, std::min(y / over, 1.0f - x / over)};
  }

  const TessellationPattern& pattern_;
  float u_, v_;
  float least_ = -std::numeric_limits<float>::infinity();
  GridPoint found_;
};

}  // namespace

GridPoint triangle_at(const TessellationPattern& p, float u, float v) {
  const int i = std::clamp(static_cast<int>(u * static_cast<float>(p.nu)), 0, p.nu - 1),
            j = std::clamp(static_cast<int>(v * static_cast<float>(p.nv)), 0, p.nv - 1);
  TriangleSearch search(p, u, v);
  search.look_at_cell(i, j);
  // Cells at an edge are cut as that edge is: the point may be in any of them.
  if (j == 0 || j == p.nv - 1)
    for (int k = 0; k < p.nu; ++k) search.look_at_cell(k, j);
  if (i == 0 || i == p.nu - 1)
    for (int k = 0; k < p.nv; ++k) search.look_at_cell(i, k);
  return search.found();
}

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
