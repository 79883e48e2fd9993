#pragma once

#include <cmath>

#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

// What coverage looks at: where a sub-patch may appear, and the corners of its moving box in raster space.
struct MovingBody {
  frontend::ScreenBounds bounds;
  frontend::MovingCorners corners;
};

// Whether all 16 corners of the moving box have finite projections in front of the camera, so that their hull, and what
// follows from it at single times, exists. False for bodies that cross the near plane and for NaN.
inline bool has_hull(const MovingBody& body) {
  if (body.bounds.crosses_near) return false;
  for (const DVec4& p : body.corners)
    if (!(p.w > 0) || !std::isfinite(p.x / p.w) || !std::isfinite(p.y / p.w) || !std::isfinite(p.w)) return false;
  return true;
}

}  // namespace tessera::binner
