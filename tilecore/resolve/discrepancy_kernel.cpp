#include <algorithm>
#include <bit>
#include <cmath>

#include "tilecore/resolve/discrepancy.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/discrepancy_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE float difference_of(const Vec4& a, const Vec4& b) { return relative_difference(a, b); }

#else

// relative_difference(): maxima of finite numbers, in any order.
HWY_INLINE float difference_of(const Vec4& a, const Vec4& b) {
  const hn::FixedTag<float, 4> d;
  const auto x = hn::LoadU(d, &a.x), y = hn::LoadU(d, &b.x);
  const auto difference = hn::Abs(hn::Sub(x, y));
  if (!hn::AllTrue(d, hn::Le(difference, hn::Set(d, kLargestDifference)))) return 1.0f;
  const auto level = hn::InsertLane(hn::Max(hn::Abs(x), hn::Abs(y)), 3, 0.0f);  // of colour alone
  const auto two = hn::Max(hn::InterleaveLower(d, difference, level), hn::InterleaveUpper(d, difference, level)),
             one = hn::Max(two, hn::Shuffle1032(two));
  alignas(16) float most[4];
  hn::Store(one, d, most);
  return std::min(1.0f, most[0] / (most[1] + kDifferenceFloor));
}

#endif

float LargestDifference(const Vec4* a16, const Vec4* b, std::ptrdiff_t b_stride, BlockMask pixels) {
  float largest = 0.0f;
  for (unsigned left = pixels; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    largest = std::max(largest, difference_of(a16[p], b[(p >> 2) * b_stride + (p & 3)]));
  }
  return largest;
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(LargestDifference);

float relative_difference(const Vec4& a, const Vec4& b) {
  const Vec4 difference = glm::abs(a - b), level = glm::max(glm::abs(a), glm::abs(b));
  for (int c = 0; c < 4; ++c)
    if (!(difference[c] <= kLargestDifference)) return 1.0f;
  const float most = std::max(std::max(difference[0], difference[1]), std::max(difference[2], difference[3]));
  return std::min(1.0f, most / (std::max(std::max(level[0], level[1]), level[2]) + kDifferenceFloor));
}

float largest_difference(const Vec4* a16, const Vec4* b, std::ptrdiff_t b_stride, BlockMask pixels) {
  return HWY_DYNAMIC_DISPATCH(LargestDifference)(a16, b, b_stride, pixels);
}

}  // namespace tessera::tilecore
#endif
