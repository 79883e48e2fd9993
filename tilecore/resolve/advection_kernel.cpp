#include <algorithm>
#include <bit>
#include <climits>
#include <cmath>

#include "tilecore/resolve/agreeing_texels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/advection_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/resolve/channels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace simd = tessera::HWY_NAMESPACE;

using D = hn::CappedTag<float, 4>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;

// An offset's whole part and the fraction towards the next, in [0, 1].
struct Split {
  VI whole;
  V fraction;

  HWY_INLINE explicit Split(V offset) {
    const DI di;
    whole = hn::ConvertTo(di, offset);
    const M above = hn::Gt(hn::ConvertTo(D(), whole), offset);
    whole = hn::Add(whole, hn::VecFromMask(di, hn::RebindMask(di, above)));  // true is -1
    fraction = hn::Sub(offset, hn::ConvertTo(D(), whole));
  }
};

// Whether first <= v and v + 1 < end: so are both texels.
HWY_INLINE M both_within(VI v, int first, int end) {
  const DI di;
  const VI at_least = hn::Set(di, first), below = hn::Set(di, end - 1);
  return hn::RebindMask(D(), hn::AndNot(hn::Lt(v, at_least), hn::Lt(v, below)));
}

// Where four pixels of a row come from: place_at() of advection.cpp, for all at once.
struct RowPlaces {
  alignas(16) std::int32_t x[4], y[4];    // upper left texels
  alignas(16) float w1[4], w2[4], w3[4];  // weights of the other three
  unsigned plain = 0;                     // bit i: all four texels have a weight and are in the region

  HWY_INLINE RowPlaces(int px, int py, const Vec2* velocity, const IntRect& region) {
    for (std::size_t i = 0; i < 4; i += hn::Lanes(D())) place(i, px, py, velocity, region);
  }

 private:
  // Those from pixel i on.
  HWY_INLINE void place(std::size_t i, int px, int py, const Vec2* velocity, const IntRect& region) {
    const D d;
    const DI di;
    V vx, vy;
    hn::LoadInterleaved2(d, &velocity[i].x, vx, vy);
    const V longest = hn::Set(d, kLongestMotion), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const M fits = hn::And(hn::Lt(hn::Abs(vx), longest), hn::Lt(hn::Abs(vy), longest));
    const Split sx(hn::IfThenElseZero(fits, hn::Neg(vx))), sy(hn::IfThenElseZero(fits, hn::Neg(vy)));
    const V fx = sx.fraction, fy = sy.fraction, weight1 = hn::Mul(fx, hn::Sub(one, fy)),
            weight2 = hn::Mul(hn::Sub(one, fx), fy), weight3 = hn::Mul(fx, fy);
    alignas(16) static constexpr std::int32_t kColumns[4] = {0, 1, 2, 3};
    const VI tx = hn::Add(sx.whole, hn::Add(hn::Set(di, px), hn::Load(di, kColumns + i))),
             ty = hn::Add(sy.whole, hn::Set(di, py));
    const M between = hn::And(hn::And(hn::Lt(fx, one), hn::Lt(fy, one)),
                              hn::And(hn::And(hn::Ne(weight1, zero), hn::Ne(weight2, zero)), hn::Ne(weight3, zero)));
    const M inside = hn::And(both_within(tx, region.x0, region.x1), both_within(ty, region.y0, region.y1));
    hn::Store(tx, di, x + i), hn::Store(ty, di, y + i);
    hn::Store(weight1, d, w1 + i), hn::Store(weight2, d, w2 + i), hn::Store(weight3, d, w3 + i);
    plain |= simd::mask_bits(d, hn::And(hn::And(fits, between), inside)) << i;
  }
};

bool FetchAgreeingTexels(const HistoryView& history, const FourTexels& texels, std::uint32_t patch, float depth,
                         float limit, Vec4* out) {
  // Two by two.
  const hn::CappedTag<float, 2> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  const auto near = [&](const float* there) HWY_ATTR {
    return hn::Le(hn::Abs(hn::Sub(hn::LoadU(d, there), hn::Set(d, depth))), hn::Set(d, limit));
  };
  const auto same = [&](const std::uint32_t* there)
                        HWY_ATTR { return hn::RebindMask(d, hn::Eq(hn::LoadU(du, there), hn::Set(du, patch))); };
  const float *depth_above = history.depth + texels.above, *depth_below = depth_above + history.row_stride;
  const std::uint32_t *patch_above = history.patch + texels.above, *patch_below = patch_above + history.row_stride;
  for (std::size_t i = 0; i < 2; i += hn::Lanes(d))
    if (!hn::AllTrue(d, hn::And(hn::And(near(depth_above + i), near(depth_below + i)),
                                hn::And(same(patch_above + i), same(patch_below + i)))))
      return false;
  const Vec4 *above = history.color + texels.above, *below = above + history.row_stride;
  const Channels base = load(above), c1 = load(above + 1), c2 = load(below), c3 = load(below + 1);
  if (!is_finite(((base - base) + (c1 - c1)) + ((c2 - c2) + (c3 - c3)))) return false;
  store(base + (((c1 - base) * texels.w1 + (c2 - base) * texels.w2) + (c3 - base) * texels.w3), out);
  return true;
}

PlainAdvection AdvectPlainPixels(const BlockOfPixels& block, std::uint16_t wanted, const HistoryView& history,
                                 float depth_tolerance, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  PlainAdvection result;
  int left = INT_MAX, top = INT_MAX, right = INT_MIN, bottom = INT_MIN;
  for (int j = 0; j < 4; ++j) {
    const std::ptrdiff_t row = j * block.row_stride;
    unsigned pixels = wanted >> (4 * j) & 15u;
    if (pixels == 0) continue;
    const RowPlaces places(block.x, block.y + j, block.velocity + row, history.region);
    for (pixels &= places.plain; pixels != 0; pixels &= pixels - 1) {
      const int i = std::countr_zero(pixels);
      const float depth = block.depth[row + i], limit = depth_tolerance * std::abs(depth);
      if (block.usable[row + i] == 0 || !std::isfinite(limit)) continue;
      const FourTexels texels{history.index(places.x[i], places.y[i]), places.w1[i], places.w2[i], places.w3[i]};
      if (!FetchAgreeingTexels(history, texels, block.patch[row + i], depth, limit, &out[j * out_stride + i])) continue;
      result.taken = static_cast<std::uint16_t>(result.taken | 1u << (4 * j + i));
      left = std::min(left, places.x[i]), right = std::max(right, places.x[i]);
      top = std::min(top, places.y[i]), bottom = std::max(bottom, places.y[i]);
    }
  }
  const auto count = static_cast<std::uint64_t>(std::popcount(result.taken));
  work.fetches += count, work.velocity_texels += count, work.history_texels += 4 * count;
  if (count > 0) result.texels = {left, top, right + 2, bottom + 2};
  return result;
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(FetchAgreeingTexels);
HWY_EXPORT(AdvectPlainPixels);

bool fetch_agreeing_texels(const HistoryView& history, const FourTexels& texels, std::uint32_t patch, float depth,
                           float limit, Vec4* out) {
  return HWY_DYNAMIC_DISPATCH(FetchAgreeingTexels)(history, texels, patch, depth, limit, out);
}

PlainAdvection advect_plain_pixels(const BlockOfPixels& block, std::uint16_t wanted, const HistoryView& history,
                                   float depth_tolerance, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  return HWY_DYNAMIC_DISPATCH(AdvectPlainPixels)(block, wanted, history, depth_tolerance, out, out_stride, work);
}

}  // namespace tessera::tilecore
#endif
