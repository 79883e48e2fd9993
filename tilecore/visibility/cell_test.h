#pragma once

#include <cstdint>
#include <limits>

namespace tessera::tilecore {

// The inside test of one sample against one cell (two triangles that share a diagonal), in the frame whose origin is
// the sample: a corner is the vertex at the sample's time, seen through the sample's lens point, relative to the
// sample's position.
//
// Edge functions e(A, B) = A.x B.y - A.y B.x are computed without fused operations: the sign of a difference of two
// rounded products equals the exact sign or is zero, never the opposite (rounding is monotone). Zero is resolved
// exactly in double (products of floats are exact there) and, on the edge itself, by a symbolic shift of the sample by
// (eps, eps^2): so two triangles that share an edge always decide oppositely, and every sample inside a closed mesh is
// in exactly one of the triangles that tile its neighbourhood. Back faces follow from all signs being negative.
struct Corner {
  float x, y;   // relative to the sample; times w for vertices that are not projected
  float scale;  // weight of the corner in perspective interpolation: 1/w, or 1 for homogeneous corners
  float z;      // depth at the sample's time
};

// +1, -1, or 0 when the two corners coincide.
inline int exact_edge_sign(float ax, float ay, float bx, float by) {
  const double e =
      static_cast<double>(ax) * static_cast<double>(by) - static_cast<double>(ay) * static_cast<double>(bx);
  if (e != 0.0) return e > 0.0 ? 1 : -1;
  if (ay != by) return ay > by ? 1 : -1;
  if (ax != bx) return bx > ax ? 1 : -1;
  return 0;
}

struct TriangleHit {
  float z, b1, b2;  // depth; weights of the second and third corner (the first has 1 - b1 - b2)
  bool positive;    // sign of the area in raster space: clockwise on screen
};

// The scalar reference. `weighted_depth`: depth from the corners' depths (orthographic, or corners that are not
// projected) instead of from their scales. Returns false if the sample is outside or the triangle degenerate. Raises
// neither the invalid nor the divide-by-zero flag for finite corners.
bool exact_triangle_test(const Corner& a, const Corner& b, const Corner& c, bool weighted_depth, TriangleHit& hit);

// Conditions on a hit besides being inside.
struct HitLimits {
  float near = 0;
  float far = std::numeric_limits<float>::infinity();
  bool keep_positive = true, keep_negative = true;  // facing
};

}  // namespace tessera::tilecore
