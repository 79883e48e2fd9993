#include "tilecore/resolve/interior_stencils.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/interior_stencils_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR

WideFill FillInterior(Reconstruction, const MirroredPattern&, const float*, std::ptrdiff_t, float*) { return {}; }

#else

// ---- Two pixels of a block in one register ------------------------------------------------------------------------

// Not wider where the instruction set has more: a pixel is 16 bytes, so that loads of one never cross a cache line, and
// longer registers would have to be put together from as many.
using D = hn::FixedTag<float, 8>;
using V = hn::Vec<D>;

struct Pixel {
  int x, y;
};
// Whose stencils are equal.
struct Pair {
  Pixel first, second;
};

// Rows of the picture around a block, from the row kWindowMargin above it on; each begins at the block's first column.
struct Rows {
  const float* row[kWindowSide];
  float* out;

  HWY_INLINE Rows(const float* block, std::ptrdiff_t stride, float* out_in) : out(out_in) {
    for (int y = 0; y < kWindowSide; ++y) row[y] = block + (y - kWindowMargin) * stride;
  }
  template <Pair P>
  HWY_INLINE V at(int dx, int dy) const {
    const hn::Half<D> half;
    return hn::Combine(D(), hn::LoadU(half, row[P.second.y + dy + kWindowMargin] + 4 * (P.second.x + dx)),
                       hn::LoadU(half, row[P.first.y + dy + kWindowMargin] + 4 * (P.first.x + dx)));
  }
  template <Pair P>
  HWY_INLINE void store(V v) const {
    const hn::Half<D> half;
    hn::StoreU(hn::LowerHalf(half, v), half, out + 4 * (4 * P.first.y + P.first.x));
    hn::StoreU(hn::UpperHalf(half, v), half, out + 4 * (4 * P.second.y + P.second.x));
  }
};

// ---- One stencil ------------------------------------------------------------------------------------------------

template <Stencil S, Pair P, std::size_t First, std::size_t Count>
HWY_INLINE V sum_of_taps(const Rows& rows) {
  if constexpr (Count == 1)
    return rows.at<P>(S.taps[First].dx, S.taps[First].dy);
  else
    return hn::Add(sum_of_taps<S, P, First, Count / 2>(rows),
                   sum_of_taps<S, P, First + Count / 2, Count - Count / 2>(rows));
}

template <Stencil S, Pair P, std::size_t First = 0>
HWY_INLINE V weighted_sum(const Rows& rows) {
  constexpr std::size_t kCount = equal_weights(S, First);
  const V product = hn::Mul(sum_of_taps<S, P, First, kCount>(rows),
                            hn::Set(D(), static_cast<float>(S.taps[First].weight) / static_cast<float>(S.unit())));
  if constexpr (First + kCount == S.count)
    return product;
  else
    return hn::Add(product, weighted_sum<S, P, First + kCount>(rows));
}

// ---- Blocks -----------------------------------------------------------------------------------------------------

// A sum of results is finite only where they are; where they are and it is not, there is needless work, and no more.
HWY_INLINE bool is_finite(V sum) { return hn::AllTrue(D(), hn::Eq(hn::Sub(sum, sum), hn::Zero(D()))); }

// All pairs before any is stored: they share taps and sums of taps. Returns the sum of the results.
template <Stencil S, Pair... P>
HWY_INLINE V fill_pairs(const Rows& rows) {
  const V results[] = {weighted_sum<S, P>(rows)...};
  const V* next = results;
  (rows.store<P>(*next++), ...);
  V sum = results[0];
  for (std::size_t i = 1; i < sizeof...(P); ++i) sum = hn::Add(sum, results[i]);
  return sum;
}

// X: column of the first missing pixel in even rows; in odd ones it is the other.
template <Reconstruction K, int X>
WideFill fill_half(const Rows& rows) {
  constexpr Stencil kAll = stencil_of(index_entry(K, 0, 1, 1));
  return {8 * kAll.count, is_finite(fill_pairs<kAll, Pair{{X, 0}, {1 - X, 1}}, Pair{{X, 2}, {1 - X, 3}},
                                               Pair{{X + 2, 0}, {3 - X, 1}}, Pair{{X + 2, 2}, {3 - X, 3}}>(rows))};
}

// Pixels of a class, the first of which is (X, Y), lie two apart both ways.
template <Stencil S, int X, int Y>
HWY_INLINE V fill_class(const Rows& rows) {
  return fill_pairs<S, Pair{{X, Y}, {X + 2, Y}}, Pair{{X, Y + 2}, {X + 2, Y + 2}}>(rows);
}

// (X, Y): the first rendered pixel.
template <Reconstruction K, int X, int Y>
WideFill fill_quarter(const Rows& rows) {
  constexpr Stencil kBeside = stencil_of(index_entry(K, 0, 0, 1)), kBelow = stencil_of(index_entry(K, 0, 0, 4)),
                    kAcross = stencil_of(index_entry(K, 0, 0, 5));
  const V beside = fill_class<kBeside, 1 - X, Y>(rows), below = fill_class<kBelow, X, 1 - Y>(rows),
          across = fill_class<kAcross, 1 - X, 1 - Y>(rows);
  return {4 * (kBeside.count + kBelow.count + kAcross.count), is_finite(hn::Add(hn::Add(beside, below), across))};
}

template <Reconstruction K>
WideFill fill_pattern(const MirroredPattern& pattern, const Rows& rows) {
  if (pattern.table_pattern == 1) return pattern.mirror & 1 ? fill_half<K, 0>(rows) : fill_half<K, 1>(rows);
  switch (pattern.mirror) {
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

WideFill FillInterior(Reconstruction kernel, const MirroredPattern& pattern, const float* block, std::ptrdiff_t stride,
                      float* out) {
  const Rows rows(block, 4 * stride, out);
  switch (kernel) {
    case Reconstruction::kBilinear:
      return fill_pattern<Reconstruction::kBilinear>(pattern, rows);
    case Reconstruction::kCubicUnscaled:
      return fill_pattern<Reconstruction::kCubicUnscaled>(pattern, rows);
    case Reconstruction::kCubic:
      return fill_pattern<Reconstruction::kCubic>(pattern, rows);
    case Reconstruction::kCubicInterpolating:
      return fill_pattern<Reconstruction::kCubicInterpolating>(pattern, rows);
    case Reconstruction::kNearest:
      break;
  }
  return {};
}

#endif

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(FillInterior);

WideFill fill_interior_block(Reconstruction kernel, const MirroredPattern& pattern, const Vec4* block,
                             std::ptrdiff_t stride, Vec4* out16) {
  return HWY_DYNAMIC_DISPATCH(FillInterior)(kernel, pattern, &block->x, stride, &out16->x);
}

}  // namespace tessera::tilecore
#endif
