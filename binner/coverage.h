#pragma once

#include <array>
#include <cmath>

#include "binner/tile_grid.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

// The input of coverage: the screen bounds of a sub-patch, and the corners of its moving box in raster space.
struct MovingBody {
  frontend::ScreenBounds bounds;
  frontend::MovingCorners corners;
};

// True if all 16 corners of the moving box have finite projections in front of the camera, so that their convex hull
// exists, at single times as well. False for bodies that cross the near plane and for NaN.
inline bool has_hull(const MovingBody& body) {
  if (body.bounds.crosses_near) return false;
  for (const DVec4& p : body.corners)
    if (!(p.w > 0) || !std::isfinite(p.x / p.w) || !std::isfinite(p.y / p.w) || !std::isfinite(p.w)) return false;
  return true;
}

// Exact coverage: which tiles of its bounding rectangle the moving box of a sub-patch may touch at some time, through
// some point of the lens. Everything drawn lies within bounds.grow pixels (in x and in y) of the convex hull of the 16
// projected corners, so a tile, grown by as much, is missed when one edge of the hull separates the two.
//
// Rules:
//   COV1  Closed: a tile that is only touched is covered, as for the rectangle.
//   COV2  Only edges are tested. The sides of the tile are the rectangle's test, which comes first: TileGrid::covered.
//   COV3  A body without a hull (has_hull) touches every tile.
//
// Built once per sub-patch; a test costs two multiplications per edge.
class ExactCoverage {
 public:
  ExactCoverage(const MovingBody& body, const TileGrid& grid);

  bool touches(int column, int row) const;

 private:
  void add_edge(double x, double y, const std::array<std::array<double, 2>, 16>& points, double grow, double size);

  // A tile is missed when x * middle_x + y * middle_y > limit; its middle is measured in tiles of the grid.
  struct Edge {
    double x, y, limit;
  };
  const TileGrid& grid_;
  std::array<Edge, 16> edges_;
  std::size_t edge_count_ = 0;
};

}  // namespace tessera::binner
