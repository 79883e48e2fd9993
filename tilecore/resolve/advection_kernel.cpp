#include <algorithm>
#include <bit>
#include <climits>
#include <cmath>
#include <limits>

#include "tilecore/resolve/advection.h"

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

// Source places of a block's pixels, place_at() of advection.cpp for four of a row at once, and the joint range of
// texels of the pixels that may be plain.
struct BlockPlaces {
  alignas(16) std::int32_t x[16], y[16];             // upper left texels
  alignas(16) float w1[16], w2[16], w3[16];          // weights of the other three
  alignas(16) float limit[16];                       // largest difference of a texel's depth from the pixel's
  std::uint16_t plain = 0;                           // bit i: all four texels have a weight and are in the region
  IntRect texels;                                    // of all plain pixels
  float nearest = 0, farthest = 0, least_limit = 0;  // of their depths and limits
  bool one_patch = true;                             // all have the patch of the block's first pixel

  HWY_INLINE BlockPlaces(const BlockOfPixels& block, std::uint16_t wanted, const IntRect& region, float slope) {
    const D d;
    const DI di;
    Bounds bounds;
    for (int j = 0; j < 4; ++j)
      if ((wanted >> (4 * j) & 15) != 0)
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) place(block, j, i, wanted, region, slope, bounds);
    if (plain == 0) return;
    texels = {hn::GetLane(hn::MinOfLanes(di, bounds.left)), hn::GetLane(hn::MinOfLanes(di, bounds.top)),
              hn::GetLane(hn::MaxOfLanes(di, bounds.right)) + 2, hn::GetLane(hn::MaxOfLanes(di, bounds.bottom)) + 2};
    nearest = hn::GetLane(hn::MinOfLanes(d, bounds.nearest)),
    farthest = hn::GetLane(hn::MaxOfLanes(d, bounds.farthest));
    least_limit = hn::GetLane(hn::MinOfLanes(d, bounds.limit));
    const hn::RebindToUnsigned<D> du;
    one_patch = hn::AllTrue(du, hn::Eq(bounds.other_patch, hn::Zero(du)));
  }

 private:
  struct Bounds {
    VI left, top, right, bottom;
    V nearest, farthest, limit;
    hn::Vec<hn::RebindToUnsigned<D>> other_patch;

    // Not by initializers of the members: GCC 12 compiles those without the region's target.
    HWY_INLINE Bounds() {
      left = top = hn::Set(DI(), INT_MAX), right = bottom = hn::Set(DI(), INT_MIN);
      nearest = limit = hn::Set(D(), std::numeric_limits<float>::infinity()), farthest = hn::Neg(nearest);
      other_patch = hn::Zero(hn::RebindToUnsigned<D>());
    }
  };

  // Places the pixels of row j from pixel i on.
  HWY_INLINE void place(const BlockOfPixels& block, int j, std::size_t i, std::uint16_t wanted, const IntRect& region,
                        float slope, Bounds& bounds) {
    const D d;
    const DI di;
    const hn::RebindToUnsigned<D> du;
    const hn::Rebind<std::uint8_t, D> du8;
    const std::ptrdiff_t from = j * block.row_stride + static_cast<std::ptrdiff_t>(i);
    const std::size_t to = 4 * static_cast<std::size_t>(j) + i;
    V vx, vy;
    hn::LoadInterleaved2(d, &block.velocity[from].x, vx, vy);
    const V longest = hn::Set(d, kLongestMotion), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const M fits = hn::And(hn::Lt(hn::Abs(vx), longest), hn::Lt(hn::Abs(vy), longest));
    const Split sx(hn::IfThenElseZero(fits, hn::Neg(vx))), sy(hn::IfThenElseZero(fits, hn::Neg(vy)));
    const V fx = sx.fraction, fy = sy.fraction, weight1 = hn::Mul(fx, hn::Sub(one, fy)),
            weight2 = hn::Mul(hn::Sub(one, fx), fy), weight3 = hn::Mul(fx, fy);
    alignas(16) static constexpr std::int32_t kColumns[4] = {0, 1, 2, 3};
    const VI tx = hn::Add(sx.whole, hn::Add(hn::Set(di, block.x), hn::Load(di, kColumns + i))),
             ty = hn::Add(sy.whole, hn::Set(di, block.y + j));
    const M between = hn::And(hn::And(hn::Lt(fx, one), hn::Lt(fy, one)),
                              hn::And(hn::And(hn::Ne(weight1, zero), hn::Ne(weight2, zero)), hn::Ne(weight3, zero)));
    const M inside = hn::And(both_within(tx, region.x0, region.x1), both_within(ty, region.y0, region.y1));
    const V depth = hn::LoadU(d, block.depth + from),
            may_differ = hn::Add(hn::Mul(hn::Set(d, kDepthTolerance), hn::Abs(depth)), hn::Set(d, slope));
    const M finite = hn::Eq(hn::Sub(may_differ, may_differ), zero),
            usable = hn::RebindMask(d, hn::Ne(hn::PromoteTo(di, hn::LoadU(du8, block.usable + from)), hn::Zero(di)));
    const M asked = hn::RebindMask(d, hn::Ne(hn::And(hn::Set(di, wanted >> to), hn::Load(di, kBits)), hn::Zero(di)));
    const M good = hn::And(hn::And(hn::And(fits, between), hn::And(inside, finite)), hn::And(usable, asked));
    hn::Store(tx, di, x + to), hn::Store(ty, di, y + to);
    hn::Store(weight1, d, w1 + to), hn::Store(weight2, d, w2 + to), hn::Store(weight3, d, w3 + to);
    hn::Store(may_differ, d, limit + to);
    plain = static_cast<std::uint16_t>(plain | simd::mask_bits(d, good) << to);
    const auto chosen = hn::RebindMask(di, good);
    bounds.left = hn::Min(bounds.left, hn::IfThenElse(chosen, tx, bounds.left));
    bounds.top = hn::Min(bounds.top, hn::IfThenElse(chosen, ty, bounds.top));
    bounds.right = hn::Max(bounds.right, hn::IfThenElse(chosen, tx, bounds.right));
    bounds.bottom = hn::Max(bounds.bottom, hn::IfThenElse(chosen, ty, bounds.bottom));
    bounds.nearest = hn::Min(bounds.nearest, hn::IfThenElse(good, depth, bounds.nearest));
    bounds.farthest = hn::Max(bounds.farthest, hn::IfThenElse(good, depth, bounds.farthest));
    bounds.limit = hn::Min(bounds.limit, hn::IfThenElse(good, may_differ, bounds.limit));
    const auto differs = hn::Xor(hn::LoadU(du, block.patch + from), hn::Set(du, *block.patch));
    bounds.other_patch = hn::Or(bounds.other_patch, hn::IfThenElseZero(hn::RebindMask(du, good), differs));
  }
  alignas(16) static constexpr std::int32_t kBits[4] = {1, 2, 4, 8};
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

// Whether every texel agrees with every plain pixel, as far as that can be told of all at once: no depth is further
// from any of theirs than the least limit, since differences are rounded in order of their size.
HWY_INLINE bool all_agree(const HistoryView& history, const BlockPlaces& places, std::uint32_t of_patch) {
  const IntRect& rect = places.texels;
  const int width = rect.width();
  constexpr int kMost = 8, kVector = 4;
  if (!places.one_patch || width < kVector || width > kMost || rect.height() > kMost) return false;
  const D d;
  const hn::RebindToUnsigned<D> du;
  const V nearest = hn::Set(d, places.nearest), farthest = hn::Set(d, places.farthest),
          limit = hn::Set(d, places.least_limit);
  V low = nearest, high = farthest, zeros = hn::Zero(d);
  auto other = hn::Zero(du);
  const auto patch = hn::Set(du, of_patch);
  for (int y = rect.y0; y < rect.y1; ++y)
    for (const int x : {rect.x0, rect.x1 - kVector}) {
      const std::ptrdiff_t at = history.index(x, y);
      for (std::size_t i = 0; i < kVector; i += hn::Lanes(d)) {
        const V depth = hn::LoadU(d, history.depth + at + i);
        low = hn::Min(low, depth), high = hn::Max(high, depth), zeros = hn::Add(zeros, hn::Sub(depth, depth));
        other = hn::Or(other, hn::Xor(hn::LoadU(du, history.patch + at + i), patch));
      }
    }
  const auto within = hn::And(hn::Le(hn::Sub(high, nearest), limit), hn::Le(hn::Sub(farthest, low), limit));
  return hn::AllTrue(d, hn::And(within, hn::Eq(zeros, hn::Zero(d)))) && hn::AllTrue(du, hn::Eq(other, hn::Zero(du)));
}

// FetchAgreeingTexels() of texels that agree, if the colour is finite.
HWY_INLINE Channels fetch_unchecked(const HistoryView& history, const FourTexels& texels) {
  const Vec4 *above = history.color + texels.above, *below = above + history.row_stride;
  const Channels base = load(above);
  return base + (((load(above + 1) - base) * texels.w1 + (load(below) - base) * texels.w2) +
                 (load(below + 1) - base) * texels.w3);
}

PlainAdvection AdvectPlainPixels(const BlockOfPixels& block, std::uint16_t wanted, const HistoryView& history,
                                 float slope, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  PlainAdvection result;
  const BlockPlaces places(block, wanted, history.region, slope);
  if (places.plain == 0) return result;
  const auto texels_of = [&](std::size_t p) HWY_ATTR {
    return FourTexels{history.index(places.x[p], places.y[p]), places.w1[p], places.w2[p], places.w3[p]};
  };
  const auto out_of = [&](std::size_t p)
                          HWY_ATTR { return &out[static_cast<std::ptrdiff_t>(p >> 2) * out_stride + (p & 3)]; };
  if (all_agree(history, places, *block.patch)) {
    Channels colors[16], zeros = splat<4>(0.0f);  // stays 0 while all colours are finite
    for (unsigned left = places.plain; left != 0; left &= left - 1) {
      const auto p = static_cast<std::size_t>(std::countr_zero(left));
      colors[p] = fetch_unchecked(history, texels_of(p));
      zeros = zeros + (colors[p] - colors[p]);
    }
    if (is_finite(zeros)) {
      for (unsigned left = places.plain; left != 0; left &= left - 1) {
        const auto p = static_cast<std::size_t>(std::countr_zero(left));
        store(colors[p], out_of(p));
      }
      result = {places.plain, places.texels};
    }
  }
  // One by one.
  if (result.taken == 0) {
    IntRect read{INT_MAX, INT_MAX, INT_MIN, INT_MIN};
    for (unsigned left = places.plain; left != 0; left &= left - 1) {
      const auto p = static_cast<std::size_t>(std::countr_zero(left));
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(p >> 2) * block.row_stride + (p & 3);
      if (!FetchAgreeingTexels(history, texels_of(p), block.patch[at], block.depth[at], places.limit[p], out_of(p)))
        continue;
      result.taken = static_cast<std::uint16_t>(result.taken | 1u << p);
      read = {std::min(read.x0, places.x[p]), std::min(read.y0, places.y[p]), std::max(read.x1, places.x[p] + 2),
              std::max(read.y1, places.y[p] + 2)};
    }
    if (result.taken != 0) result.texels = read;
  }
  const auto count = static_cast<std::uint64_t>(std::popcount(result.taken));
  work.fetches += count, work.velocity_texels += count, work.history_texels += 4 * count;
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
                                   float slope, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  return HWY_DYNAMIC_DISPATCH(AdvectPlainPixels)(block, wanted, history, slope, out, out_stride, work);
}

}  // namespace tessera::tilecore
#endif
