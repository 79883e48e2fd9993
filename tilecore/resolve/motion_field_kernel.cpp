#include "tilecore/resolve/motion_field.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/motion_field_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace simd = tessera::HWY_NAMESPACE;

using D = hn::CappedTag<float, MotionField::RigidPoints::kCount>;
using V = hn::Vec<D>;

// Row `r` of the matrix times (x w, y w, z, 1).
HWY_INLINE V row_times(const Mat4& m, int r, V xw, V yw, V z) {
  const D d;
  const V sum = hn::Add(hn::Mul(xw, hn::Set(d, m[0][r])), hn::Mul(yw, hn::Set(d, m[1][r])));
  return hn::Add(hn::Add(sum, hn::Mul(z, hn::Set(d, m[2][r]))), hn::Set(d, m[3][r]));
}

void RigidSteps(const Mat4& m, bool orthographic, const MotionField::RigidPoints& points,
                MotionField::RigidSteps& steps) {
  const D d;
  const V zero = hn::Zero(d);
  steps.usable = 0;
  for (std::size_t i = 0; i < MotionField::RigidPoints::kCount; i += hn::Lanes(d)) {
    const V x = hn::Load(d, &points.x[i]), y = hn::Load(d, &points.y[i]), z = hn::Load(d, &points.depth[i]);
    const V w = orthographic ? hn::Set(d, 1.0f) : z, xw = hn::Mul(x, w), yw = hn::Mul(y, w);
    const V depth = row_times(m, 2, xw, yw, z), then_w = row_times(m, 3, xw, yw, z);
    const V vx = hn::Sub(x, hn::Div(row_times(m, 0, xw, yw, z), then_w)),
            vy = hn::Sub(y, hn::Div(row_times(m, 1, xw, yw, z), then_w));
    const auto in_front = hn::And(hn::Gt(w, zero), hn::Gt(then_w, zero)),
               finite = hn::And(hn::Eq(hn::Sub(vx, vx), zero), hn::Eq(hn::Sub(vy, vy), zero)),
               usable = hn::And(in_front, finite);
    const V used_x = hn::IfThenElseZero(usable, vx), used_y = hn::IfThenElseZero(usable, vy);
    hn::Store(used_x, d, &steps.x[i]), hn::Store(used_y, d, &steps.y[i]);
    hn::Store(hn::IfThenElseZero(usable, depth), d, &steps.depth[i]);
    hn::Store(hn::Sqrt(hn::Add(hn::Mul(used_x, used_x), hn::Mul(used_y, used_y))), d, &steps.speed[i]);
    steps.usable |= simd::mask_bits(d, usable) << i;
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(RigidSteps);

void MotionField::rigid_steps(std::uint32_t d, const RigidPoints& points, struct RigidSteps& steps) const {
  HWY_DYNAMIC_DISPATCH(RigidSteps)(motions_[d].reprojection, orthographic_, points, steps);
}

}  // namespace tessera::tilecore
#endif
