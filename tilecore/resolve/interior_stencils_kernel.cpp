#include "tilecore/resolve/stencil_kernels.h"

#include <bit>

#include "tilecore/resolve/block_pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/interior_stencils_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/resolve/channels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// ---- One stencil ------------------------------------------------------------------------------------------------

// `taps.at(dx, dy)`: the tap there, relative to the pixel to fill or to both pixels of a pair.
template <Stencil S, std::size_t First, std::size_t Count, class Taps>
HWY_INLINE auto sum_of_taps(const Taps& taps) {
  if constexpr (Count == 1)
    return taps.at(S.taps[First].dx, S.taps[First].dy);
  else
    return sum_of_taps<S, First, Count / 2>(taps) + sum_of_taps<S, First + Count / 2, Count - Count / 2>(taps);
}

// One product per different weight. Counts are powers of two, so the sums of a flat colour are exact.
template <Stencil S, std::size_t First = 0, class Taps>
HWY_INLINE auto weighted_sum(const Taps& taps) {
  constexpr std::size_t kCount = equal_weights(S, First);
  static_assert(std::has_single_bit(kCount));
  constexpr float kWeight = static_cast<float>(S.taps[First].weight) / static_cast<float>(S.unit());
  const auto product = sum_of_taps<S, First, kCount>(taps) * kWeight;
  if constexpr (First + kCount == S.count)
    return product;
  else
    return product + weighted_sum<S, First + kCount>(taps);
}

// ---- One pixel in a register ------------------------------------------------------------------------------------

struct PixelTaps {
  const Vec4* center;
  std::ptrdiff_t stride;

  HWY_INLINE Channels at(int dx, int dy) const { return load(center + dy * stride + dx); }
};

template <Stencil S>
HWY_INLINE Channels apply(const InteriorBlock& block, int pixel) {
  return weighted_sum<S>(PixelTaps{block.first + (pixel / 4) * block.stride + pixel % 4, block.stride});
}

// Patterns repeat every two rows, so pixels p and p + 8 have the same stencil: both before anything is stored, since
// they share taps and sums of taps.
template <Stencil S>
InteriorFill fill_pixels(const InteriorBlock& block, BlockMask pixels) {
  Channels zeros = splat<4>(0.0f);  // stays +0 while all results are finite
  const unsigned pairs = pixels & pixels >> 8;
  for (unsigned left = pairs; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const Channels above = apply<S>(block, p), below = apply<S>(block, p + 8);
    zeros = zeros + ((above - above) + (below - below));
    store(above, block.out16 + p);
    store(below, block.out16 + p + 8);
  }
  for (unsigned left = pixels & ~(pairs | pairs << 8); left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const Channels r = apply<S>(block, p);
    zeros = zeros + (r - r);
    store(r, block.out16 + p);
  }
  return {S.count * pixel_count(pixels), is_finite(zeros)};
}

template <Reconstruction K>
InteriorFill fill_each(const InteriorBlock& block) {
  const MirroredPattern& p = block.pattern;
  if (p.table_pattern == 1) return fill_pixels<stencil_of(index_entry(K, 0, 1, 1))>(block, block.missing);
  const int x = p.mirror & 1, y = p.mirror >> 1;
  const auto among = [&](int dx, int dy) {
    return static_cast<BlockMask>(block.missing & sparse_square(x ^ dx, y ^ dy));
  };
  const InteriorFill beside = fill_pixels<stencil_of(index_entry(K, 0, 0, 1))>(block, among(1, 0)),
                     below = fill_pixels<stencil_of(index_entry(K, 0, 0, 4))>(block, among(0, 1)),
                     across = fill_pixels<stencil_of(index_entry(K, 0, 0, 5))>(block, among(1, 1));
  return {beside.taps + below.taps + across.taps, beside.finite && below.finite && across.finite};
}

#if HWY_MAX_BYTES >= 32

// ---- Two pixels in a register -----------------------------------------------------------------------------------

// Not wider where the instruction set has more: a pixel is 16 bytes, so that loads of one never cross a cache line, and
// longer registers would have to be put together from as many.
using TwoPixels = Floats<8>;

struct Pixel {
  int x, y;
};
// Whose stencils are equal.
struct Pair {
  Pixel first, second;
};

// Rows of the image around a block, from the row kWindowMargin above it on; each begins at the block's first column.
struct Rows {
  const float* row[kWindowSide];
  float* out;

  HWY_INLINE explicit Rows(const InteriorBlock& block) : out(&block.out16->x) {
    for (int y = 0; y < kWindowSide; ++y) row[y] = &block.first->x + 4 * (y - kWindowMargin) * block.stride;
  }
  template <Pair P>
  HWY_INLINE void store_pair(TwoPixels v) const {
    const hn::Half<TwoPixels::D> half;
    hn::StoreU(hn::LowerHalf(half, v.part[0]), half, out + 4 * (4 * P.first.y + P.first.x));
    hn::StoreU(hn::UpperHalf(half, v.part[0]), half, out + 4 * (4 * P.second.y + P.second.x));
  }
};

template <Pair P>
struct PairTaps {
  const Rows& rows;

  HWY_INLINE TwoPixels at(int dx, int dy) const {
    const hn::Half<TwoPixels::D> half;
    return {
        {hn::Combine(TwoPixels::D(), hn::LoadU(half, rows.row[P.second.y + dy + kWindowMargin] + 4 * (P.second.x + dx)),
                     hn::LoadU(half, rows.row[P.first.y + dy + kWindowMargin] + 4 * (P.first.x + dx)))}};
  }
};

// All pairs before any is stored: they share taps and sums of taps. Returns the sum of the results: finite only where
// they are; where they are and it is not, there is needless work, and no more.
template <Stencil S, Pair... P>
HWY_INLINE TwoPixels fill_pairs(const Rows& rows) {
  const TwoPixels results[] = {weighted_sum<S>(PairTaps<P>{rows})...};
  const TwoPixels* next = results;
  (rows.store_pair<P>(*next++), ...);
  TwoPixels sum = results[0];
  for (std::size_t i = 1; i < sizeof...(P); ++i) sum = sum + results[i];
  return sum;
}

// X: column of the first missing pixel in even rows; in odd ones it is the other.
template <Reconstruction K, int X>
InteriorFill fill_half(const Rows& rows) {
  constexpr Stencil kAll = stencil_of(index_entry(K, 0, 1, 1));
  return {8 * kAll.count, is_finite(fill_pairs<kAll, Pair{{X, 0}, {1 - X, 1}}, Pair{{X, 2}, {1 - X, 3}},
                                               Pair{{X + 2, 0}, {3 - X, 1}}, Pair{{X + 2, 2}, {3 - X, 3}}>(rows))};
}

// Pixels of a class, the first of which is (X, Y), lie two apart both ways.
template <Stencil S, int X, int Y>
HWY_INLINE TwoPixels fill_class(const Rows& rows) {
  return fill_pairs<S, Pair{{X, Y}, {X + 2, Y}}, Pair{{X, Y + 2}, {X + 2, Y + 2}}>(rows);
}

// (X, Y): the first rendered pixel.
template <Reconstruction K, int X, int Y>
InteriorFill fill_quarter(const Rows& rows) {
  constexpr Stencil kBeside = stencil_of(index_entry(K, 0, 0, 1)), kBelow = stencil_of(index_entry(K, 0, 0, 4)),
                    kAcross = stencil_of(index_entry(K, 0, 0, 5));
  const TwoPixels beside = fill_class<kBeside, 1 - X, Y>(rows), below = fill_class<kBelow, X, 1 - Y>(rows),
                  across = fill_class<kAcross, 1 - X, 1 - Y>(rows);
  return {4 * (kBeside.count + kBelow.count + kAcross.count), is_finite((beside + below) + across)};
}

template <Reconstruction K>
InteriorFill fill_whole(const InteriorBlock& block) {
  const Rows rows(block);
  if (block.pattern.table_pattern == 1) return block.pattern.mirror & 1 ? fill_half<K, 0>(rows) : fill_half<K, 1>(rows);
  switch (block.pattern.mirror) {
    case 0:
      return fill_quarter<K, 0, 0>(rows);
    case 1:
      return fill_quarter<K, 1, 0>(rows);
    case 2:
      return fill_quarter<K, 0, 1>(rows);
    default:
      return fill_quarter<K, 1, 1>(rows);
  }
}

#else

template <Reconstruction K>
InteriorFill fill_whole(const InteriorBlock& block) {
  return fill_each<K>(block);
}

#endif

// ---- Blocks -----------------------------------------------------------------------------------------------------

template <Reconstruction K>
InteriorFill fill_pattern(const InteriorBlock& block) {
  return block.whole ? fill_whole<K>(block) : fill_each<K>(block);
}

InteriorFill FillInterior(Reconstruction kernel, const InteriorBlock& block) {
  switch (kernel) {
    case Reconstruction::kBilinear:
      return fill_pattern<Reconstruction::kBilinear>(block);
    case Reconstruction::kCubicUnscaled:
      return fill_pattern<Reconstruction::kCubicUnscaled>(block);
    case Reconstruction::kCubic:
      return fill_pattern<Reconstruction::kCubic>(block);
    case Reconstruction::kCubicInterpolating:
      return fill_pattern<Reconstruction::kCubicInterpolating>(block);
    case Reconstruction::kNearest:
      break;
  }
  return {};
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(FillInterior);

InteriorFill fill_interior(Reconstruction kernel, const InteriorBlock& block) {
  return HWY_DYNAMIC_DISPATCH(FillInterior)(kernel, block);
}

}  // namespace tessera::tilecore
#endif
