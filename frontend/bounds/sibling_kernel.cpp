#include "frontend/bounds/patch_net.h"
#include "frontend/bounds/sibling_boxes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "frontend/bounds/sibling_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

// Every lane does the operations of the functions that bound one part, in their order; nothing is fused. A condition
// there is a mask here; a lane whose mask is off divides by 1.
HWY_BEFORE_NAMESPACE();
namespace tessera::frontend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kSiblings>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;
constexpr D kD;

HWY_INLINE V set(double x) { return hn::Set(kD, x); }

struct Vectors {
  V x, y, z;
};
HWY_INLINE Vectors splat(const DVec3& p) { return {set(p.x), set(p.y), set(p.z)}; }
HWY_INLINE Vectors operator+(const Vectors& a, const Vectors& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vectors operator-(const Vectors& a, const Vectors& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vectors operator*(const Vectors& a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }
HWY_INLINE V dot(const Vectors& a, const Vectors& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vectors cross(const Vectors& a, const Vectors& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(b.y, a.z)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(b.z, a.x)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(b.x, a.y))};
}
HWY_INLINE Vectors select(M mask, const Vectors& a, const Vectors& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}
HWY_INLINE V one_unless(M mask, V v) { return hn::IfThenElse(mask, v, set(1.0)); }

// ---- Nets -------------------------------------------------------------------------------------------------------

struct Weights {
  V w[4][4];  // [point][of the base's points]
};
HWY_INLINE Weights Restriction(V a, V b) {
  Weights out;
  for (std::size_t k = 0; k < 4; ++k) {
    const V r = k > 2 ? b : a, s = k > 1 ? b : a, t = k > 0 ? b : a;
    const V r1 = hn::Sub(set(1.0), r), s1 = hn::Sub(set(1.0), s), t1 = hn::Sub(set(1.0), t);
    const auto product = [](V x, V y, V z) HWY_ATTR { return hn::Mul(hn::Mul(x, y), z); };
    out.w[k][0] = product(r1, s1, t1);
    out.w[k][1] = hn::Add(hn::Add(product(r, s1, t1), product(r1, s, t1)), product(r1, s1, t));
    out.w[k][2] = hn::Add(hn::Add(product(r, s, t1), product(r, s1, t)), product(r1, s, t));
    out.w[k][3] = product(r, s, t);
  }
  return out;
}
HWY_INLINE V Weighted(const V (&w)[4], V a, V b, V c, V d) {
  return hn::Add(hn::Add(hn::Mul(a, w[0]), hn::Mul(b, w[1])), hn::Add(hn::Mul(c, w[2]), hn::Mul(d, w[3])));
}

struct Net {
  V c[3][16];
  HWY_INLINE Vectors at(std::size_t k) const { return {c[0][k], c[1][k], c[2][k]}; }
};

// Rows [0, 4) in steps, points [0, 4) of each in steps: 3 for the corners alone.
template <std::size_t kStep>
HWY_INLINE void Restrict(const PatchNet& net, const Weights& u, const Weights& v, Net& out) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* c = net.c[axis].data();
    for (std::size_t j = 0; j < 4; j += kStep) {
      V row[4];
      for (std::size_t i = 0; i < 4; ++i)
        row[i] = Weighted(v.w[j], set(c[i]), set(c[4 + i]), set(c[8 + i]), set(c[12 + i]));
      for (std::size_t k = 0; k < 4; k += kStep)
        out.c[axis][4 * j + k] = Weighted(u.w[k], row[0], row[1], row[2], row[3]);
    }
  }
}

struct CornerFrames {
  Vectors axes[3];
  Vectors tangent_u, tangent_v;
  V sine_between;
  M regular;
};
HWY_INLINE CornerFrames Frames(const Net* nets, std::size_t keys) {
  Vectors t = splat(DVec3(0.0)), b = t;
  for (std::size_t key = 0; key < keys; ++key) {
    const Vectors c00 = nets[key].at(0), c30 = nets[key].at(3), c03 = nets[key].at(12), c33 = nets[key].at(15);
    t = t + ((c30 - c00) + (c33 - c03));
    b = b + ((c03 - c00) + (c33 - c30));
  }
  const Vectors n = cross(t, b);
  const V tiny = set(kTinyLength2), one = set(1.0);
  const V n_length = hn::Sqrt(dot(n, n)), t_inverse = hn::Div(one, hn::Max(hn::Sqrt(dot(t, t)), tiny)),
          b_inverse = hn::Div(one, hn::Max(hn::Sqrt(dot(b, b)), tiny));
  const V sine = hn::Mul(hn::Mul(n_length, t_inverse), b_inverse);
  const M regular = hn::And(hn::Gt(sine, set(kLeastFrameSine)), hn::Gt(n_length, hn::Zero(kD)));
  const Vectors x = splat({1, 0, 0}), y = splat({0, 1, 0}), z = splat({0, 0, 1});
  CornerFrames out;
  out.regular = regular;
  out.tangent_u = select(regular, t * t_inverse, x);
  out.tangent_v = select(regular, b * b_inverse, y);
  const Vectors up = n * hn::Div(one, one_unless(regular, n_length));
  out.axes[0] = out.tangent_u;
  out.axes[1] = select(regular, cross(up, out.tangent_u), y);
  out.axes[2] = select(regular, up, z);
  out.sine_between = one_unless(regular, sine);
  return out;
}

struct Ends {
  V low, high;
};
HWY_INLINE Ends Extent(const Net& net, const Vectors& axis) {
  Ends e;
  e.low = e.high = dot(net.at(0), axis);
  for (std::size_t k = 1; k < 16; ++k) {
    const V s = dot(net.at(k), axis);
    e.low = hn::Min(e.low, s);
    e.high = hn::Max(e.high, s);
  }
  return e;
}

struct Spreads {
  V min_dot, min_cosine2, max_length2;
};
// Spread of the steps from each point to the next, which is `kNext` further.
template <std::size_t kNext>
HWY_INLINE Spreads Spread(const Net& net, const Vectors& axis) {
  Spreads out;
  for (std::size_t k = 0; k < (kNext == 1 ? 16 : 12); ++k) {
    if (kNext == 1 && k % 4 == 3) continue;
    const Vectors v = net.at(k + kNext) - net.at(k);
    const V along = dot(v, axis), length2 = dot(v, v);
    const V cosine2 = hn::Div(hn::Mul(along, along), hn::Max(length2, set(kTinyLength2)));
    out.min_dot = k == 0 ? along : hn::Min(out.min_dot, along);
    out.min_cosine2 = k == 0 ? cosine2 : hn::Min(out.min_cosine2, cosine2);
    out.max_length2 = k == 0 ? length2 : hn::Max(out.max_length2, length2);
  }
  return out;
}

// ---- Normals ----------------------------------------------------------------------------------------------------

struct Cones {
  M any;
  V sine, cosine, error;
};
HWY_INLINE Cones NoCones() {
  const V zero = hn::Zero(kD);
  return {hn::Gt(zero, zero), zero, zero, zero};
}
HWY_INLINE V WidenedSine(V cosine2) {
  return hn::Sqrt(hn::Add(hn::Max(hn::Zero(kD), hn::Sub(set(1.0), cosine2)), set(kConeSlack)));
}
HWY_INLINE V NormalError(M any, double absolute, V length_u, V length_v, V sine) {
  const V products = hn::Mul(hn::Mul(set(32 * 0x1p-24), length_u), length_v);
  const V divisor = hn::Mul(hn::Mul(length_u, length_v), sine);
  return hn::Div(hn::Add(hn::Mul(set(absolute), hn::Add(length_u, length_v)), products), one_unless(any, divisor));
}
HWY_INLINE Cones Checked(M any, V sine, V error) {
  const M good = hn::And(any, hn::And(hn::Lt(sine, set(1.0)), hn::Lt(error, set(kLargestNormalError))));
  const V cosine2 = hn::Max(hn::Sub(set(1.0), hn::Mul(sine, sine)), hn::Zero(kD));
  return {good, sine, hn::Mul(hn::Sqrt(cosine2), set(1 - kConeSlack)), error};
}

struct Scales {
  V u, v;  // extents of the part in the base patch's parameters
};
// A derivative's least length by those parameters, from a third of that by the part's own.
HWY_INLINE V ScaledLength(M any, V third, V scale) {
  return hn::Div(hn::Mul(set(3.0), one_unless(any, third)), one_unless(any, scale));
}

HWY_INLINE Cones TangentCone(const Spreads& u, const Spreads& v, const CornerFrames& frame, double rounding,
                             const Scales& scales) {
  const V zero = hn::Zero(kD), slack = set(kConeSlack);
  M any = hn::And(frame.regular, hn::And(hn::Gt(u.min_dot, zero), hn::Gt(v.min_dot, zero)));
  const V sine_u = WidenedSine(u.min_cosine2), sine_v = WidenedSine(v.min_cosine2);
  const V cosine_between = hn::Abs(dot(frame.tangent_u, frame.tangent_v));
  const V cosine_u = hn::Sqrt(hn::Max(zero, hn::Sub(u.min_cosine2, slack))),
          cosine_v = hn::Sqrt(hn::Max(zero, hn::Sub(v.min_cosine2, slack)));
  const V sine_sum = hn::Add(hn::Mul(sine_u, cosine_v), hn::Mul(cosine_u, sine_v)),
          cosine_sum = hn::Sub(hn::Mul(cosine_u, cosine_v), hn::Mul(sine_u, sine_v));
  const V min_sine =
      hn::Sub(hn::Sub(hn::Mul(frame.sine_between, cosine_sum), hn::Mul(cosine_between, sine_sum)), slack);
  any = hn::And(any, hn::Gt(min_sine, set(kLeastSine)));
  const V both = hn::Mul(hn::Mul(hn::Mul(set(2.0), sine_u), sine_v), cosine_between);
  const V sum = hn::Add(hn::Add(hn::Mul(sine_u, sine_u), both), hn::Mul(sine_v, sine_v));
  const V sine = hn::Mul(hn::Div(hn::Sqrt(sum), frame.sine_between), set(1 + kConeSlack));
  const V length_u = ScaledLength(any, hn::Mul(u.min_dot, set(1 - kConeSlack)), scales.u),
          length_v = ScaledLength(any, hn::Mul(v.min_dot, set(1 - kConeSlack)), scales.v);
  return Checked(any, sine, NormalError(any, rounding, length_u, length_v, min_sine));
}

// Least product of the normal's control vectors with the axis, and squared cosine: see MeasureNormals.
struct NormalSpreads {
  V min_dot, min_cosine2;
};
HWY_NOINLINE NormalSpreads SpreadOfNormals(const Net& net, const Vectors& axis) {
  static constexpr double kTwo[3] = {1, 2, 1}, kThree[4] = {1, 3, 3, 1}, kFive[6] = {1, 5, 10, 10, 5, 1};
  Vectors a[12], b[12];
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      a[3 * j + i] = (net.at(4 * j + i + 1) - net.at(4 * j + i)) * set(kTwo[i] * kThree[j]);
  for (std::size_t l = 0; l < 3; ++l)
    for (std::size_t k = 0; k < 4; ++k)
      b[4 * l + k] = (net.at(4 * l + k + 4) - net.at(4 * l + k)) * set(kThree[k] * kTwo[l]);
  NormalSpreads out{set(1e300), set(1e300)};
  for (std::size_t q = 0; q < 6; ++q)
    for (std::size_t p = 0; p < 6; ++p) {
      Vectors n = splat(DVec3(0.0));
      for (std::size_t i = p > 3 ? p - 3 : 0; i < 3 && i <= p; ++i) {
        Vectors sum = splat(DVec3(0.0));
        for (std::size_t j = q > 2 ? q - 2 : 0; j <= q && j < 4; ++j)
          sum = sum + cross(a[3 * j + i], b[4 * (q - j) + p - i]);
        n = n + sum;
      }
      const V along = dot(n, axis), length2 = dot(n, n);
      out.min_dot = hn::Min(out.min_dot, hn::Div(along, set(kFive[p] * kFive[q])));
      out.min_cosine2 = hn::Min(out.min_cosine2, hn::Div(hn::Mul(along, along), hn::Max(length2, set(kTinyLength2))));
    }
  return out;
}

HWY_INLINE Cones NormalsCone(const Net& net, const Spreads& u, const Spreads& v, const CornerFrames& frame,
                             const Cones& tangents, double rounding, const Scales& scales) {
  const NormalSpreads spread = SpreadOfNormals(net, frame.axes[2]);
  M any = hn::And(frame.regular, hn::Gt(spread.min_dot, hn::Zero(kD)));
  const V max_u = one_unless(any, hn::Sqrt(u.max_length2)), max_v = one_unless(any, hn::Sqrt(v.max_length2));
  const V least_sine = hn::Div(spread.min_dot, hn::Mul(max_u, max_v));
  any = hn::And(any, hn::Gt(least_sine, set(kLeastSine)));
  const V length_u = ScaledLength(any, hn::Div(spread.min_dot, max_v), scales.u),
          length_v = ScaledLength(any, hn::Div(spread.min_dot, max_u), scales.v);
  const Cones own =
      Checked(any, WidenedSine(spread.min_cosine2), NormalError(any, rounding, length_u, length_v, least_sine));
  const M both = hn::And(own.any, tangents.any);
  const auto joined = [&](V joint, V of_own, V of_tangents) HWY_ATTR {
    return hn::IfThenElse(both, joint, hn::IfThenElse(own.any, of_own, of_tangents));
  };
  return {hn::Or(own.any, tangents.any), joined(hn::Min(own.sine, tangents.sine), own.sine, tangents.sine),
          joined(hn::Max(own.cosine, tangents.cosine), own.cosine, tangents.cosine),
          joined(hn::Min(own.error, tangents.error), own.error, tangents.error)};
}

// ---- Boxes ------------------------------------------------------------------------------------------------------

// Smallest and largest offset * normal, added to the extent along the normals' z, or across it.
HWY_INLINE Ends Displaced(const Ends& base, const Ends& offset, const Ends& normal) {
  const V a = hn::Mul(offset.low, normal.low), b = hn::Mul(offset.low, normal.high),
          c = hn::Mul(offset.high, normal.low), d = hn::Mul(offset.high, normal.high);
  return {hn::Add(base.low, hn::Min(hn::Min(a, b), hn::Min(c, d))),
          hn::Add(base.high, hn::Max(hn::Max(a, b), hn::Max(c, d)))};
}
HWY_INLINE Ends NormalAlong(const Cones& cones, std::size_t axis) {
  const V one = set(1.0);
  const V side = hn::Add(cones.sine, cones.error);
  const V low = axis < 2 ? hn::Neg(side) : hn::Sub(cones.cosine, cones.error),
          high = axis < 2 ? side : hn::Add(one, cones.error);
  return {hn::IfThenElse(cones.any, low, hn::Neg(one)), hn::IfThenElse(cones.any, high, one)};
}

struct Boxes {
  CornerFrames frame;
  Ends ends[2][3];  // [key][axis]
};

HWY_INLINE Ends ends_of(const SiblingOffsets& offsets, std::size_t lane) {
  return {hn::LoadU(kD, offsets.low.data() + lane), hn::LoadU(kD, offsets.high.data() + lane)};
}

HWY_INLINE void BoundInterior(const SiblingParts& parts, std::size_t lane, Boxes& box) {
  const auto load = [&](const SiblingLanes& values) HWY_ATTR { return hn::LoadU(kD, values.data() + lane); };
  const SiblingParameters& r = parts.inner;
  const Scales scales = {hn::Sub(load(r.u1), load(r.u0)), hn::Sub(load(r.v1), load(r.v0))};
  const Weights u = Restriction(load(r.u0), load(r.u1)), v = Restriction(load(r.v0), load(r.v1));
  Net nets[2];
  const std::size_t keys = parts.keys.size();
  for (std::size_t key = 0; key < keys; ++key) Restrict<1>(parts.keys[key], u, v, nets[key]);
  CornerFrames& frame = box.frame;
  if (parts.oriented && parts.all_inner) {
    frame = Frames(nets, keys);
  } else if (parts.oriented) {
    const SiblingParameters& w = parts.whole;
    const Weights whole_u = Restriction(load(w.u0), load(w.u1)), whole_v = Restriction(load(w.v0), load(w.v1));
    Net corners[2];
    for (std::size_t key = 0; key < keys; ++key) Restrict<3>(parts.keys[key], whole_u, whole_v, corners[key]);
    frame = Frames(corners, keys);
  } else {
    frame.axes[0] = splat({1, 0, 0}), frame.axes[1] = splat({0, 1, 0}), frame.axes[2] = splat({0, 0, 1});
  }
  const Ends offset = ends_of(parts.offsets, lane);
  for (std::size_t key = 0; key < keys; ++key) {
    Cones cones = NoCones();
    if (parts.normals != NormalsBy::kNothing) {
      const Spreads along_u = Spread<1>(nets[key], frame.tangent_u), along_v = Spread<4>(nets[key], frame.tangent_v);
      cones = TangentCone(along_u, along_v, frame, parts.rounding, scales);
      if (parts.normals == NormalsBy::kNormals)
        cones = NormalsCone(nets[key], along_u, along_v, frame, cones, parts.rounding, scales);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      box.ends[key][axis] = Displaced(Extent(nets[key], frame.axes[axis]), offset, NormalAlong(cones, axis));
  }
}

HWY_INLINE void Extend(Ends& ends, M touched, const Ends& by) {
  ends.low = hn::IfThenElse(touched, hn::Min(ends.low, by.low), ends.low);
  ends.high = hn::IfThenElse(touched, hn::Max(ends.high, by.high), ends.high);
}

HWY_INLINE void RestrictCubic(const std::array<DVec3, 4>& points, const Weights& rows, Vectors (&out)[4]) {
  const Vectors p[4] = {splat(points[0]), splat(points[1]), splat(points[2]), splat(points[3])};
  for (std::size_t k = 0; k < 4; ++k)
    out[k] = (p[0] * rows.w[k][0] + p[1] * rows.w[k][1]) + (p[2] * rows.w[k][2] + p[3] * rows.w[k][3]);
}

HWY_INLINE Cones EdgeCone(const Vectors (&points)[4], const Vectors (&across)[4], const SiblingEdge& edge, M touched,
                          const Vectors& z, V scale) {
  const V zero = hn::Zero(kD);
  V min_dot = set(1e300), min_cosine2 = set(1.0), max_along2 = zero, max_across2 = zero;
  for (const Vectors& b : across) max_across2 = hn::Max(max_across2, dot(b, b));
  for (std::size_t i = 0; i < 3; ++i) {
    const Vectors a = points[i + 1] - points[i];
    max_along2 = hn::Max(max_along2, dot(a, a));
    for (const Vectors& b : across) {
      const Vectors n = cross(a, b);
      const V along = hn::Mul(dot(n, z), set(edge.turned)), length2 = dot(n, n);
      const M counts = hn::Gt(length2, zero);
      const V cosine2 = hn::Div(hn::Mul(along, along), one_unless(counts, length2));
      min_dot = hn::Min(min_dot, along);
      min_cosine2 = hn::IfThenElse(counts, hn::Min(min_cosine2, cosine2), min_cosine2);
    }
  }
  M any = hn::And(touched, hn::Gt(min_dot, zero));
  const V max_along = one_unless(any, hn::Sqrt(max_along2)), max_across = one_unless(any, hn::Sqrt(max_across2));
  const V least = one_unless(any, min_dot), least_sine = hn::Div(least, hn::Mul(max_along, max_across));
  any = hn::And(any, hn::Gt(least_sine, set(kLeastSine)));
  const V third = hn::Mul(set(3.0), least);
  const V error = NormalError(any, edge.rounding, hn::Div(hn::Div(third, max_across), one_unless(any, scale)),
                              hn::Div(third, max_along), least_sine);
  return Checked(any, WidenedSine(min_cosine2), error);
}

HWY_NOINLINE void BoundEdge(const SiblingParts& parts, const SiblingEdge& edge, std::size_t lane, Boxes& box) {
  const auto load = [&](const SiblingLanes& values) HWY_ATTR { return hn::LoadU(kD, values.data() + lane); };
  const M touched = hn::Ne(load(edge.touched), hn::Zero(kD));
  const V first = load(edge.first), last = load(edge.last);
  const Weights rows = Restriction(first, last);
  const Ends offset = ends_of(edge.offsets, lane);
  for (std::size_t key = 0; key < parts.keys.size(); ++key) {
    Vectors points[4], across[4];
    RestrictCubic(*edge.points[key], rows, points);
    Cones cones = NoCones();
    if (parts.normals != NormalsBy::kNothing) {
      RestrictCubic(*edge.across[key], rows, across);
      cones = EdgeCone(points, across, edge, touched, box.frame.axes[2], hn::Sub(last, first));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vectors& direction = box.frame.axes[axis];
      const V a = dot(points[0], direction), b = dot(points[1], direction), c = dot(points[2], direction),
              d = dot(points[3], direction);
      const Ends base = {hn::Min(hn::Min(a, b), hn::Min(c, d)), hn::Max(hn::Max(a, b), hn::Max(c, d))};
      Extend(box.ends[key][axis], touched, Displaced(base, offset, NormalAlong(cones, axis)));
    }
  }
}

void BoundSiblings(const SiblingParts& parts, SiblingBoxes& out) {
  for (std::size_t lane = 0; lane < kSiblings; lane += hn::Lanes(kD)) {
    Boxes box;
    BoundInterior(parts, lane, box);
    for (const SiblingEdge& edge : parts.edges) BoundEdge(parts, edge, lane, box);
    for (const SiblingCorner& corner : parts.corners) {
      const M touched = hn::Ne(hn::LoadU(kD, corner.touched.data() + lane), hn::Zero(kD));
      for (std::size_t key = 0; key < parts.keys.size(); ++key)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const V s = dot(splat(corner.at[key]), box.frame.axes[axis]);
          Extend(box.ends[key][axis], touched, {s, s});
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      hn::StoreU(box.frame.axes[axis].x, kD, out.axes[axis][0].data() + lane);
      hn::StoreU(box.frame.axes[axis].y, kD, out.axes[axis][1].data() + lane);
      hn::StoreU(box.frame.axes[axis].z, kD, out.axes[axis][2].data() + lane);
      for (std::size_t key = 0; key < 2; ++key) {
        const Ends& ends = box.ends[key < parts.keys.size() ? key : 0][axis];
        hn::StoreU(ends.low, kD, out.low[key][axis].data() + lane);
        hn::StoreU(ends.high, kD, out.high[key][axis].data() + lane);
      }
    }
  }
}

}  // namespace tessera::frontend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::frontend {

HWY_EXPORT(BoundSiblings);

void bound_siblings(const SiblingParts& parts, SiblingBoxes& boxes) {
  HWY_DYNAMIC_DISPATCH(BoundSiblings)(parts, boxes);
}

}  // namespace tessera::frontend
#endif
