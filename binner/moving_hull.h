#pragma once

#include <cmath>

#include "frontend/front_end.h"

namespace tessera::binner {

// Whether all 16 corners of the moving box have finite projections in front of the camera, so that their hull, and what
// follows from it at single times, exists. False for bodies that cross the near plane and for NaN.
inline bool has_hull(const frontend::BoundedSubPatch& sub_patch) {
  if (sub_patch.bounds.crosses_near) return false;
  for (const DVec4& p : sub_patch.corners)
    if (!(p.w > 0) || !std::isfinite(p.x / p.w) || !std::isfinite(p.y / p.w) || !std::isfinite(p.w)) return false;
  return true;
}

}  // namespace tessera::binner
