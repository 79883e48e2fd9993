#include <algorithm>
#include <bit>
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

// Pixels that may be plain, with what all of them together ask of the texels.
struct Candidates {
  std::uint16_t pixels = 0;
  bool one_patch = true;
  std::uint32_t patch = 0;
  float nearest = 0, farthest = 0, least_limit = 0;  // of their depths; of what texels may be away from them
  IntRect texels;

  HWY_INLINE void add(int number, std::uint32_t of_patch, float depth, float limit, int x, int y) {
    if (pixels == 0) {
      patch = of_patch, nearest = farthest = depth, least_limit = limit;
      texels = {x, y, x + 2, y + 2};
    }
    pixels = static_cast<std::uint16_t>(pixels | 1u << number);
    one_patch = one_patch && of_patch == patch;
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth),
    least_limit = std::min(least_limit, limit);
    texels = {std::min(texels.x0, x), std::min(texels.y0, y), std::max(texels.x1, x + 2), std::max(texels.y1, y + 2)};
  }
};

// Whether every texel of the rectangle agrees with every candidate, as far as that can be told of all at once: no depth
// is further from any of theirs than the least limit, since differences are rounded in order of their size.
HWY_INLINE bool all_agree(const HistoryView& history, const Candidates& c) {
  const IntRect& rect = c.texels;
  const int width = rect.width();
  constexpr int kMost = 8, kVector = 4;
  if (!c.one_patch || width < kVector || width > kMost || rect.height() > kMost) return false;
  const D d;
  const hn::RebindToUnsigned<D> du;
  V low = hn::Set(d, c.nearest), high = hn::Set(d, c.farthest), zeros = hn::Zero(d);
  auto other = hn::Zero(du);
  const auto patch = hn::Set(du, c.patch);
  for (int y = rect.y0; y < rect.y1; ++y)
    for (const int x : {rect.x0, rect.x1 - kVector}) {
      const std::ptrdiff_t at = history.index(x, y);
      for (std::size_t i = 0; i < kVector; i += hn::Lanes(d)) {
        const V depth = hn::LoadU(d, history.depth + at + i);
        low = hn::Min(low, depth), high = hn::Max(high, depth), zeros = hn::Add(zeros, hn::Sub(depth, depth));
        other = hn::Or(other, hn::Xor(hn::LoadU(du, history.patch + at + i), patch));
      }
    }
  const auto within = hn::And(hn::Le(hn::Sub(high, hn::Set(d, c.nearest)), hn::Set(d, c.least_limit)),
                              hn::Le(hn::Sub(hn::Set(d, c.farthest), low), hn::Set(d, c.least_limit)));
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
                                 float depth_tolerance, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  FourTexels texels[16];
  std::int32_t left[16], top[16];
  float limits[16];
  Candidates candidates;
  for (int j = 0; j < 4; ++j) {
    const std::ptrdiff_t row = j * block.row_stride;
    unsigned pixels = wanted >> (4 * j) & 15u;
    if (pixels == 0) continue;
    const RowPlaces places(block.x, block.y + j, block.velocity + row, history.region);
    for (pixels &= places.plain; pixels != 0; pixels &= pixels - 1) {
      const int i = std::countr_zero(pixels), p = 4 * j + i;
      const float depth = block.depth[row + i], limit = depth_tolerance * std::abs(depth);
      if (block.usable[row + i] == 0 || !std::isfinite(limit)) continue;
      texels[p] = {history.index(places.x[i], places.y[i]), places.w1[i], places.w2[i], places.w3[i]};
      left[p] = places.x[i], top[p] = places.y[i], limits[p] = limit;
      candidates.add(p, block.patch[row + i], depth, limit, places.x[i], places.y[i]);
    }
  }
  PlainAdvection result;
  if (candidates.pixels == 0) return result;
  const auto out_of = [&](int p) HWY_ATTR { return &out[(p >> 2) * out_stride + (p & 3)]; };
  if (all_agree(history, candidates)) {
    Channels colors[16], zeros = splat<4>(0.0f);  // stays 0 while all colours are finite
    for (unsigned pixels = candidates.pixels; pixels != 0; pixels &= pixels - 1) {
      const int p = std::countr_zero(pixels);
      colors[p] = fetch_unchecked(history, texels[p]);
      zeros = zeros + (colors[p] - colors[p]);
    }
    if (is_finite(zeros)) {
      for (unsigned pixels = candidates.pixels; pixels != 0; pixels &= pixels - 1)
        store(colors[std::countr_zero(pixels)], out_of(std::countr_zero(pixels)));
      result = {candidates.pixels, candidates.texels};
    }
  }
  // One by one.
  if (result.taken == 0) {
    Candidates taken;
    for (unsigned pixels = candidates.pixels; pixels != 0; pixels &= pixels - 1) {
      const int p = std::countr_zero(pixels);
      const std::ptrdiff_t at = (p >> 2) * block.row_stride + (p & 3);
      if (FetchAgreeingTexels(history, texels[p], block.patch[at], block.depth[at], limits[p], out_of(p)))
        taken.add(p, 0, 0.0f, 0.0f, left[p], top[p]);
    }
    result = {taken.pixels, taken.texels};
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
                                   float depth_tolerance, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  return HWY_DYNAMIC_DISPATCH(AdvectPlainPixels)(block, wanted, history, depth_tolerance, out, out_stride, work);
}

}  // namespace tessera::tilecore
#endif
