#include "binner/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::binner {
namespace {

using Point = std::array<double, 2>;
using Points = std::array<Point, 16>;

// > 0 if c lies left of the directed line from a to b.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Corners of the hull of sorted points, counter-clockwise with y up (monotone chain: Andrew 1979). Rounding may leave
// out a corner or keep a superfluous one; the tests do not depend on it, see add_edge.
std::size_t convex_hull(const Points& sorted, std::array<Point, 33>& hull) {
  std::size_t count = 0;
  const auto add = [&](const Point& p, std::size_t keep) {
    while (count >= keep + 2 && !(turn(hull[count - 2], hull[count - 1], p) > 0)) --count;
    hull[count++] = p;
  };
  for (const Point& p : sorted) add(p, 0);
  const std::size_t lower = count - 1;
  for (std::size_t i = sorted.size() - 1; i-- > 0;) add(sorted[i], lower);
  return count - 1;  // the last corner repeats the first
}

}  // namespace

ExactCoverage::ExactCoverage(const MovingBody& body, const TileGrid& grid) : grid_(grid) {
  if (!has_hull(body)) return;
  Points points;
  double size = std::max(std::abs(grid.column_edge(grid.columns())), std::abs(grid.row_edge(grid.rows())));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const DVec4& corner = body.corners[i];
    points[i] = {corner.x / corner.w, corner.y / corner.w};
    size = std::max({size, std::abs(points[i][0]), std::abs(points[i][1])});
  }
  Points sorted = points;
  std::sort(sorted.begin(), sorted.end());
  std::array<Point, 33> hull;
  const std::size_t count = convex_hull(sorted, hull);
  for (std::size_t k = 0; k < count && edge_count_ < edges_.size(); ++k)
    add_edge(hull[k + 1][1] - hull[k][1], hull[k][0] - hull[k + 1][0], points, static_cast<double>(body.bounds.grow),
             size);
}

void ExactCoverage::add_edge(double x, double y, const Points& points, double grow, double size) {
  if (x == 0 || y == 0) return;  // COV2; also edges of no length
  // Any direction gives a valid test: the offset comes from the farthest of all points, not from the ends of the edge.
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Point& p : points) farthest = std::max(farthest, x * p[0] + y * p[1]);
  // A dot product is off by 3 roundings of terms up to (|x| + |y|) * size, a projected corner by one: below 2^-50 of
  // it.
  const double reach =
      std::abs(x) * (grow + 0.5 * grid_.tile_width()) + std::abs(y) * (grow + 0.5 * grid_.tile_height());
  const double limit = farthest + reach + (std::abs(x) + std::abs(y)) * (size + grow) * 0x1p-44;
  edges_[edge_count_++] = {x, y, limit};
}

bool ExactCoverage::touches(int column, int row) const {
  const double x = grid_.column_edge(column) + 0.5 * grid_.tile_width(),
               y = grid_.row_edge(row) + 0.5 * grid_.tile_height();
  for (std::size_t k = 0; k < edge_count_; ++k)
    if (edges_[k].x * x + edges_[k].y * y > edges_[k].limit) return false;
  return true;
}

}  // namespace tessera::binner
