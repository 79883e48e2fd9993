#include "frontend/bounds/patch_net.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "frontend/bounds/patch_net_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

// Results do not depend on the target: every lane does the same operations, nothing is fused, and reductions over lanes
// are minima or maxima.
HWY_BEFORE_NAMESPACE();
namespace tessera::frontend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 4>;
using V = hn::Vec<D>;
constexpr D kD;

struct Vectors {
  V x, y, z;
};
HWY_INLINE Vectors splat(const DVec3& p) { return {hn::Set(kD, p.x), hn::Set(kD, p.y), hn::Set(kD, p.z)}; }
HWY_INLINE Vectors load(const double* x, const double* y, const double* z, std::size_t k) {
  return {hn::LoadU(kD, x + k), hn::LoadU(kD, y + k), hn::LoadU(kD, z + k)};
}
HWY_INLINE V dot(const Vectors& a, const Vectors& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE double lowest(V v) { return hn::GetLane(hn::MinOfLanes(kD, v)); }
HWY_INLINE double highest(V v) { return hn::GetLane(hn::MaxOfLanes(kD, v)); }

void RestrictNet(const PatchNet& net, const std::array<std::array<double, 4>, 4>& along_u,
                 const std::array<std::array<double, 4>, 4>& along_v, PatchNet& out) {
  const std::size_t lanes = hn::Lanes(kD);
  // Weights along u, one column of them per control point.
  alignas(64) double column[4][4];
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 4; ++k) column[i][k] = along_u[k][i];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* c = net.c[axis].data();
    alignas(64) double rows[16];
    for (std::size_t j = 0; j < 4; ++j) {
      const auto& w = along_v[j];
      for (std::size_t i = 0; i < 4; i += lanes) {
        const V low = hn::Add(hn::Mul(hn::LoadU(kD, c + i), hn::Set(kD, w[0])),
                              hn::Mul(hn::LoadU(kD, c + 4 + i), hn::Set(kD, w[1])));
        const V high = hn::Add(hn::Mul(hn::LoadU(kD, c + 8 + i), hn::Set(kD, w[2])),
                               hn::Mul(hn::LoadU(kD, c + 12 + i), hn::Set(kD, w[3])));
        hn::StoreU(hn::Add(low, high), kD, rows + 4 * j + i);
      }
    }
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; k += lanes) {
        const auto term = [&](std::size_t i)
                              HWY_ATTR { return hn::Mul(hn::Set(kD, rows[4 * j + i]), hn::LoadU(kD, column[i] + k)); };
        hn::StoreU(hn::Add(hn::Add(term(0), term(1)), hn::Add(term(2), term(3))), kD, &out.c[axis][4 * j + k]);
      }
  }
}

Extents MeasureExtents(const PatchNet& net, const Frame& axes) {
  Extents extents;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Vectors direction = splat(axes[axis]);
    V low = dot(load(net.c[0].data(), net.c[1].data(), net.c[2].data(), 0), direction), high = low;
    for (std::size_t k = hn::Lanes(kD); k < 16; k += hn::Lanes(kD)) {
      const V s = dot(load(net.c[0].data(), net.c[1].data(), net.c[2].data(), k), direction);
      low = hn::Min(low, s);
      high = hn::Max(high, s);
    }
    extents.low[axis] = lowest(low);
    extents.high[axis] = highest(high);
  }
  return extents;
}

// Twelve vectors of one tangent against its axis.
HWY_INLINE TangentSpread Spread(const double (&a)[3][12], const DVec3& axis) {
  const Vectors direction = splat(axis);
  V min_dot, min_cosine2, max_length2;
  for (std::size_t k = 0; k < 12; k += hn::Lanes(kD)) {
    const Vectors v = load(a[0], a[1], a[2], k);
    const V along = dot(v, direction), length2 = dot(v, v);
    const V cosine2 = hn::Div(hn::Mul(along, along), hn::Max(length2, hn::Set(kD, kTinyLength2)));
    min_dot = k == 0 ? along : hn::Min(min_dot, along);
    min_cosine2 = k == 0 ? cosine2 : hn::Min(min_cosine2, cosine2);
    max_length2 = k == 0 ? length2 : hn::Max(max_length2, length2);
  }
  return {lowest(min_dot), lowest(min_cosine2), highest(max_length2)};
}

// Differences along u (3*j + i) and along v (4*j + i).
HWY_INLINE void Differences(const PatchNet& net, double (&u)[3][12], double (&v)[3][12]) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* c = net.c[axis].data();
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 3; ++i) u[axis][3 * j + i] = c[4 * j + i + 1] - c[4 * j + i];
    for (std::size_t k = 0; k < 12; ++k) v[axis][k] = c[k + 4] - c[k];
  }
}

NetMeasure MeasureNet(const PatchNet& net, const Frame& axes, const DVec3& tangent_u, const DVec3& tangent_v) {
  alignas(64) double u[3][12], v[3][12];
  Differences(net, u, v);
  return {MeasureExtents(net, axes), Spread(u, tangent_u), Spread(v, tangent_v)};
}

// The normal dp/du x dp/dv: the product of degrees (2,3) and (3,2). With the binomials moved into the factors, control
// vector (p, q) is, up to the positive factor C(5,p) C(5,q), the sum over i + k = p and j + l = q of
// C(2,i) C(3,j) a(i,j) x C(3,k) C(2,l) b(k,l).
NormalSpread MeasureNormals(const PatchNet& net, const DVec3& z) {
  static constexpr double kTwo[3] = {1, 2, 1}, kThree[4] = {1, 3, 3, 1};
  alignas(64) double u[3][12], v[3][12];
  Differences(net, u, v);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 3; ++i) u[axis][3 * j + i] *= kTwo[i] * kThree[j];
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t l = 0; l < 3; ++l)
      for (std::size_t k = 0; k < 4; ++k) v[axis][4 * l + k] *= kThree[k] * kTwo[l];

  const std::size_t lanes = hn::Lanes(kD);
  const Vectors direction = splat(z);
  V min_dot = hn::Set(kD, 1e300), min_cosine2 = min_dot;
  for (std::size_t q = 0; q < 6; ++q) {
    // Products with a(i, .) land in columns i .. i + 3 of row q; eight columns, the last two stay zero.
    alignas(64) double row[3][3][8] = {};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t first = 0; first < 4; first += lanes) {
        Vectors sum = splat(DVec3(0.0));
        for (std::size_t j = q > 2 ? q - 2 : 0; j <= std::min<std::size_t>(q, 3); ++j) {
          const Vectors a = splat({u[0][3 * j + i], u[1][3 * j + i], u[2][3 * j + i]}),
                        b = load(v[0], v[1], v[2], 4 * (q - j) + first);
          sum.x = hn::Add(sum.x, hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)));
          sum.y = hn::Add(sum.y, hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)));
          sum.z = hn::Add(sum.z, hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x)));
        }
        hn::StoreU(sum.x, kD, row[i][0] + i + first);
        hn::StoreU(sum.y, kD, row[i][1] + i + first);
        hn::StoreU(sum.z, kD, row[i][2] + i + first);
      }
    static constexpr double kFive[8] = {1, 5, 10, 10, 5, 1, 1, 1};
    for (std::size_t p = 0; p < 6; p += lanes) {
      const std::size_t at = std::min(p, 6 - lanes);  // the last vector may look at some twice
      const auto joined = [&](std::size_t axis) HWY_ATTR {
        return hn::Add(hn::Add(hn::LoadU(kD, row[0][axis] + at), hn::LoadU(kD, row[1][axis] + at)),
                       hn::LoadU(kD, row[2][axis] + at));
      };
      const Vectors n = {joined(0), joined(1), joined(2)};
      const V along = dot(n, direction), length2 = dot(n, n);
      min_dot = hn::Min(min_dot, hn::Div(along, hn::Mul(hn::LoadU(kD, kFive + at), hn::Set(kD, kFive[q]))));
      min_cosine2 = hn::Min(min_cosine2, hn::Div(hn::Mul(along, along), hn::Max(length2, hn::Set(kD, kTinyLength2))));
    }
  }
  return {lowest(min_dot), lowest(min_cosine2)};
}

}  // namespace tessera::frontend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::frontend {

HWY_EXPORT(RestrictNet);
HWY_EXPORT(MeasureExtents);
HWY_EXPORT(MeasureNet);
HWY_EXPORT(MeasureNormals);

PatchNet restrict_net(const PatchNet& net, const scene::ParameterRange& range) {
  PatchNet out;
  HWY_DYNAMIC_DISPATCH(RestrictNet)
  (net, cubic_restriction(static_cast<double>(range.u0), static_cast<double>(range.u1)),
   cubic_restriction(static_cast<double>(range.v0), static_cast<double>(range.v1)), out);
  return out;
}
Extents measure_extents(const PatchNet& net, const Frame& axes) {
  return HWY_DYNAMIC_DISPATCH(MeasureExtents)(net, axes);
}
NetMeasure measure_net(const PatchNet& net, const Frame& axes, const DVec3& tangent_u, const DVec3& tangent_v) {
  return HWY_DYNAMIC_DISPATCH(MeasureNet)(net, axes, tangent_u, tangent_v);
}
NormalSpread measure_normals(const PatchNet& net, const DVec3& z) {
  return HWY_DYNAMIC_DISPATCH(MeasureNormals)(net, z);
}

}  // namespace tessera::frontend
#endif
