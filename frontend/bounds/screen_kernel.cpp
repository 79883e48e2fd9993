#include <cmath>

#include "frontend/bounds/oriented_box.h"
#include "frontend/bounds/screen_bounds.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "frontend/bounds/screen_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

// Results do not depend on the target: lanes hold coordinates or points, nothing is fused, and reductions over lanes
// are minima or maxima.
HWY_BEFORE_NAMESPACE();
namespace tessera::frontend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 4>;
using V = hn::Vec<D>;
constexpr D kD;

void CornersOfBox(const MovingBox& box, const std::array<DMat4, 2>& to_raster, MovingCorners& corners) {
  for (std::size_t key = 0; key < 2; ++key)
    for (int lane = 0; lane < 4; lane += static_cast<int>(hn::Lanes(kD))) {
      const auto column = [&](int c) HWY_ATTR { return hn::LoadU(kD, &to_raster[key][c][lane]); };
      // The box's sides in raster space; corners are sums of one end of each.
      V end[3][2];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const DVec3& a = box.axes[axis];
        const V side = hn::Add(hn::Add(hn::Mul(column(0), hn::Set(kD, a.x)), hn::Mul(column(1), hn::Set(kD, a.y))),
                               hn::Mul(column(2), hn::Set(kD, a.z)));
        end[axis][0] = hn::Mul(side, hn::Set(kD, box.low[key][axis]));
        end[axis][1] = hn::Mul(side, hn::Set(kD, box.high[key][axis]));
      }
      for (V& e : end[2]) e = hn::Add(e, column(3));
      for (std::size_t i = 0; i < 8; ++i)
        hn::StoreU(hn::Add(hn::Add(end[0][i & 1], end[1][i >> 1 & 1]), end[2][i >> 2]), kD,
                   &corners[8 * key + i][lane]);
    }
}

// Rows of |matrix| * (reach, reach, reach, 1), the larger of both keys.
void LargestTerms(const std::array<DMat4, 2>& to_raster, double reach, std::array<double, 4>& rows) {
  for (int lane = 0; lane < 4; lane += static_cast<int>(hn::Lanes(kD))) {
    V largest = hn::Zero(kD);
    for (const DMat4& m : to_raster) {
      V sum = hn::Abs(hn::LoadU(kD, &m[3][lane]));
      for (int c = 0; c < 3; ++c) sum = hn::Add(sum, hn::Mul(hn::Abs(hn::LoadU(kD, &m[c][lane])), hn::Set(kD, reach)));
      largest = hn::Max(largest, sum);
    }
    hn::StoreU(largest, kD, rows.data() + lane);
  }
}

bool HullInFront(const DVec4* points, std::size_t count, double near, ScreenHull& hull) {
  const V zero = hn::Zero(kD);
  V x0 = hn::Set(kD, ScreenHull::kEmpty), y0 = x0, near_z = x0, near_w = x0;
  V x1 = hn::Neg(x0), y1 = x1, far_z = x1;
  for (std::size_t k = 0; k < count; k += hn::Lanes(kD)) {
    V x, y, z, w;
    hn::LoadInterleaved4(kD, &points[k].x, x, y, z, w);
    const auto nothing = [](V v) HWY_ATTR { return hn::Sub(v, v); };  // unless it is NaN or infinite
    const V point = hn::Add(hn::Add(nothing(x), nothing(y)), hn::Add(nothing(z), nothing(w)));
    if (!hn::AllTrue(kD, hn::And(hn::Ge(z, hn::Set(kD, near)), hn::Eq(point, zero)))) return false;
    const V inverse = hn::Div(hn::Set(kD, 1.0), w);
    x = hn::Mul(x, inverse);
    y = hn::Mul(y, inverse);
    if (!hn::AllTrue(kD, hn::Eq(hn::Add(nothing(x), nothing(y)), zero))) return false;
    x0 = hn::Min(x0, x);
    x1 = hn::Max(x1, x);
    y0 = hn::Min(y0, y);
    y1 = hn::Max(y1, y);
    near_z = hn::Min(near_z, z);
    far_z = hn::Max(far_z, z);
    near_w = hn::Min(near_w, w);
  }
  const auto lowest = [](V v) HWY_ATTR { return hn::GetLane(hn::MinOfLanes(kD, v)); };
  const auto highest = [](V v) HWY_ATTR { return hn::GetLane(hn::MaxOfLanes(kD, v)); };
  hull = {lowest(x0), lowest(y0), highest(x1), highest(y1), lowest(near_z), highest(far_z), lowest(near_w), false};
  return true;
}

}  // namespace tessera::frontend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::frontend {

HWY_EXPORT(CornersOfBox);
HWY_EXPORT(LargestTerms);
HWY_EXPORT(HullInFront);

MovingCorners corners_of_box(const MovingBox& box, const std::array<DMat4, 2>& to_raster) {
  MovingCorners corners;
  HWY_DYNAMIC_DISPATCH(CornersOfBox)(box, to_raster, corners);
  return corners;
}

std::array<double, 4> largest_terms(const std::array<DMat4, 2>& to_raster, double reach) {
  std::array<double, 4> rows;
  HWY_DYNAMIC_DISPATCH(LargestTerms)(to_raster, reach, rows);
  return rows;
}

bool hull_in_front(std::span<const DVec4> points, double near, ScreenHull& hull) {
  constexpr std::size_t kMaxLanes = 4;
  return points.size() % kMaxLanes == 0 && HWY_DYNAMIC_DISPATCH(HullInFront)(points.data(), points.size(), near, hull);
}

}  // namespace tessera::frontend
#endif
