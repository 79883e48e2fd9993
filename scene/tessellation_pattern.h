#pragma once

#include <array>
#include <cstdint>

#include "base/vec.h"
#include "scene/tessellation_settings.h"

namespace tessera::scene {

// The parametric grid of one base patch: nu x nv cells, fixed by the patch and the camera alone. Sub-patches are
// ranges of it, so cutting a patch never changes its triangles.
//
// Along an edge whose factor is smaller than the grid's, grid vertices are moved to the edge's own coarser parameters:
// vertex i of n goes to round(i * factor / n) / factor. Both patches at an edge then have exactly the same vertices on
// it (some coincide; their triangles are degenerate), whatever their grids: crack-free for any pair of factors.
// Edges are numbered as in PatchNeighbours: 0 v=0, 1 v=1 (along u), 2 u=0, 3 u=1 (along v).
struct TessellationPattern {
  std::uint8_t nu = 1, nv = 1;
  std::array<std::uint8_t, 4> edge{1, 1, 1, 1};  // factors, <= nu (edges 0, 1) or nv (edges 2, 3)

  // Number of the edge vertex that grid vertex i of n moves to, in [0, factor]. Monotone in i, 0 at 0, factor at n,
  // onto when factor <= n.
  static int edge_vertex(int i, int n, int factor) { return (2 * i * factor + n) / (2 * n); }

  // Parameters of grid vertex (i, j).
  float u(int i, int j) const {
    if (j == 0 || j == nv) {
      const int factor = edge[j == 0 ? 0 : 1];
      return static_cast<float>(edge_vertex(i, nu, factor)) / static_cast<float>(factor);
    }
    return static_cast<float>(i) / static_cast<float>(nu);
  }
  float v(int i, int j) const {
    if (i == 0 || i == nu) {
      const int factor = edge[i == 0 ? 2 : 3];
      return static_cast<float>(edge_vertex(j, nv, factor)) / static_cast<float>(factor);
    }
    return static_cast<float>(j) / static_cast<float>(nv);
  }
};

// A point on a triangle of a grid: weights of its second and third corner. Cells lie row by row, and each has two
// triangles: one with its vertices (0, 0), (1, 0), (1, 1), one with (0, 0), (1, 1), (0, 1).
struct GridPoint {
  std::uint32_t triangle = 0;
  float b1 = 0, b2 = 0;
};
// The grid vertex (i, j) that is corner `k`, 0 to 2, of a triangle.
struct GridCorner {
  int i, j;
};
inline GridCorner grid_corner(const TessellationPattern& pattern, std::uint32_t triangle, std::size_t k) {
  const int cell = static_cast<int>(triangle / 2), i = cell % pattern.nu, j = cell / pattern.nu;
  if (k == 0) return {i, j};
  const bool along_u = triangle % 2 == 0;
  return along_u ? GridCorner{i + 1, k == 1 ? j : j + 1} : GridCorner{k == 1 ? i + 1 : i, j + 1};
}
// The triangle of the grid that holds the parameters (u, v), both in [0, 1]; the nearest one where rounding leaves them
// outside of all.
GridPoint triangle_at(const TessellationPattern& pattern, float u, float v);

// A sub-patch: cells [i0, i1) x [j0, j1) of a Bezier patch's grid, or cells [i0, i1) of a cluster with j0 = 0, j1 = 1.
struct CellRange {
  std::uint8_t i0 = 0, j0 = 0, i1 = 0, j1 = 0;
  bool operator==(const CellRange&) const = default;
};

// Smallest parametric box that holds all vertices of a range, moved edge vertices included.
struct ParameterRange {
  float u0, v0, u1, v1;
};
ParameterRange parameter_range(const TessellationPattern& pattern, const CellRange& range);

// Tessellation factor of a curve with these four control points in raster space (xh, yh, depth, w), at both motion
// keys: the length of its control polygon on screen, at the key where it is longer, over the target. It depends on the
// curve alone, is the same for the reversed curve, and is monotone in length; points nearer than w = near_w count as if
// at near_w.
int curve_factor(const std::array<std::array<Vec4, 4>, 2>& curve, float near_w, const TessellationSettings& settings,
                 int max_factor);

}  // namespace tessera::scene
