#include <algorithm>
#include <type_traits>

#include "tilecore/visibility/tile_frustum.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility/tile_frustum_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<double>;
using DF = hn::Rebind<float, D>;
using DI = hn::Rebind<std::int32_t, D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;
using Leaf = MicroMesh::Leaf;

// LeafInterval of tile_frustum.cpp, lane by lane; the same operations in the same order.
struct LeafIntervals {
  V low, high;

  HWY_INLINE void keep_below(V a, V b, V slack) {
    const D d;
    const V zero = hn::Zero(d), open = hn::Sub(a, slack), close = hn::Sub(hn::Add(a, b), slack);
    const M outside_at_open = hn::Gt(open, zero), outside_at_close = hn::Gt(close, zero);
    const V crossing = hn::Div(open, hn::Sub(open, close));
    low = hn::IfThenElse(hn::AndNot(outside_at_close, outside_at_open), hn::Max(low, crossing), low);
    high = hn::IfThenElse(hn::AndNot(outside_at_open, outside_at_close), hn::Min(high, crossing), high);
    high = hn::IfThenElse(hn::And(outside_at_open, outside_at_close), hn::Set(d, -1.0), high);
  }

  HWY_INLINE void keep_touching(V face_low, V face_high, V drift, int begin, int end, V reach) {
    const D d;
    const V first = hn::Set(d, begin), last = hn::Set(d, end), two = hn::Set(d, 2.0);
    const V size = hn::Add(
        hn::Add(hn::Add(hn::Add(hn::Abs(face_low), hn::Abs(face_high)), hn::Mul(two, hn::Abs(drift))), hn::Abs(last)),
        reach);
    const V slack = hn::Add(reach, hn::Mul(size, hn::Set(d, 0x1p-20)));
    keep_below(hn::Sub(face_low, last), drift, slack);
    keep_below(hn::Sub(first, face_high), hn::Neg(drift), slack);
  }
};

void TouchingTimes(std::span<const Leaf> leaves, const IntRect& pixels, bool moving, float lens_scale, TimeRange* out) {
  static_assert(std::is_trivially_copyable_v<Leaf> && sizeof(Leaf) % sizeof(float) == 0);
  const D d;
  const DI di;
  constexpr std::size_t kMaxLanes = hn::MaxLanes(D());
  for (std::size_t l = 0; l < leaves.size(); l += hn::Lanes(d)) {
    const std::size_t count = std::min(hn::Lanes(d), leaves.size() - l);
    alignas(64) float field[7][kMaxLanes] = {};
    for (std::size_t k = 0; k < count; ++k) {
      const Leaf& leaf = leaves[l + k];
      const float values[7] = {leaf.x_low,   leaf.x_high,  leaf.y_low,      leaf.y_high,
                               leaf.drift_x, leaf.drift_y, leaf.lens_factor};
      for (std::size_t f = 0; f < 7; ++f) field[f][k] = values[f];
    }
    alignas(64) float rates[kMaxLanes] = {};
    for (std::size_t k = 0; k < count; ++k) rates[k] = leaves[l + k].rate;
    const auto get = [&](const float* values) HWY_ATTR { return hn::PromoteTo(d, hn::Load(DF(), values)); };
    const V x_low = get(field[0]), x_high = get(field[1]);
    const V reach = hn::Mul(hn::Set(d, static_cast<double>(lens_scale)), hn::Abs(get(field[6])));
    LeafIntervals interval{hn::Zero(d), hn::Set(d, 1.0)};
    interval.keep_touching(x_low, x_high, get(field[4]), pixels.x0, pixels.x1, reach);
    interval.keep_touching(get(field[2]), get(field[3]), get(field[5]), pixels.y0, pixels.y1, reach);
    const M touched = hn::And(hn::Le(x_low, x_high), hn::Le(interval.low, interval.high));
    alignas(64) std::int32_t first[kMaxLanes], last[kMaxLanes];
    if (moving) {
      const V rate = get(rates), one = hn::Set(d, 1.0), codes = hn::Set(d, 256.0);
      const auto time = [&](V tau) HWY_ATTR {
        return hn::Mul(hn::Div(tau, hn::Add(tau, hn::Mul(rate, hn::Sub(one, tau)))), codes);
      };
      // Untouched lanes may hold any value; their results are not used.
      const V from = hn::IfThenElseZero(touched, hn::Floor(time(interval.low))),
              to = hn::IfThenElseZero(touched, hn::Ceil(time(interval.high)));
      hn::Store(hn::DemoteTo(di, hn::Max(hn::Zero(d), hn::Sub(from, one))), di, first);
      hn::Store(hn::DemoteTo(di, hn::Min(hn::Set(d, 255.0), hn::Add(to, one))), di, last);
    } else {
      hn::Store(hn::Zero(di), di, first);
      hn::Store(hn::Set(di, 255), di, last);
    }
    const std::uint32_t bits = tessera::HWY_NAMESPACE::mask_bits(d, touched);
    for (std::size_t k = 0; k < count; ++k)
      out[l + k] = (bits >> k & 1) != 0 ? TimeRange{first[k], last[k]} : TimeRange{1, 0};
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(TouchingTimes);

void touching_times(std::span<const MicroMesh::Leaf> leaves, const IntRect& pixels, bool moving, float lens_scale,
                    std::span<TimeRange> out) {
  HWY_DYNAMIC_DISPATCH(TouchingTimes)(leaves, pixels, moving, lens_scale, out.data());
}

}  // namespace tessera::tilecore
#endif
