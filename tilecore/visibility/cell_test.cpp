#include "tilecore/visibility/cell_test.h"

namespace tessera::tilecore {
namespace {

// Rounded as in the kernels; if the result is zero, the double-precision value to the nearest float.
float edge_value(const Corner& a, const Corner& b) {
  const float p = a.x * b.y, q = a.y * b.x, e = p - q;
  if (e != 0.0f) return e;
  return static_cast<float>(static_cast<double>(a.x) * static_cast<double>(b.y) -
                            static_cast<double>(a.y) * static_cast<double>(b.x));
}

}  // namespace

bool exact_triangle_test(const Corner& a, const Corner& b, const Corner& c, bool weighted_depth, TriangleHit& hit) {
  const int s_ab = exact_edge_sign(a.x, a.y, b.x, b.y);
  if (s_ab == 0) return false;
  if (exact_edge_sign(b.x, b.y, c.x, c.y) != s_ab || exact_edge_sign(c.x, c.y, a.x, a.y) != s_ab) return false;
  const float e_bc = edge_value(b, c), e_ca = edge_value(c, a), e_ab = edge_value(a, b);
  const float b0 = e_bc * a.scale, b1 = e_ca * b.scale, b2 = e_ab * c.scale;
  const float sum = (b0 + b1) + b2;
  hit.z = weighted_depth ? ((b0 * a.z + b1 * b.z) + b2 * c.z) / sum : ((e_bc + e_ca) + e_ab) / sum;
  hit.b1 = b1 / sum;
  hit.b2 = b2 / sum;
  hit.positive = s_ab > 0;
  return true;
}

}  // namespace tessera::tilecore
