#include <bit>

#include "tilecore/resolve/multisample_resolve.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/multisample_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void store_mean(const Vec3* color, const float* coverage, float* out) {
  const Vec4 mean = mean_of_samples<4>(color, coverage);
  for (int c = 0; c < 4; ++c) out[c] = mean[c];
}

#else

// Colours are r0 g0 b0 r1, g1 b1 r2 g2, b2 r3 g3 b3: a sample after the other at the beginning of a register.
HWY_INLINE void store_mean(const Vec3* color, const float* coverage, float* out) {
  const hn::FixedTag<float, 4> d;
  const float* numbers = &color->x;
  const auto first = hn::LoadU(d, numbers), middle = hn::LoadU(d, numbers + 4), last = hn::LoadU(d, numbers + 8);
  const auto sum =
      hn::Add(hn::Add(hn::Add(hn::Add(hn::Zero(d), first), hn::CombineShiftRightBytes<12>(d, middle, first)),
                      hn::CombineShiftRightBytes<8>(d, last, middle)),
              hn::ShiftRightLanes<1>(d, last));
  const float covered = 0.0f + coverage[0] + coverage[1] + coverage[2] + coverage[3];
  hn::StoreU(hn::Mul(hn::InsertLane(sum, 3, covered), hn::Set(d, 0.25f)), d, out);
}

#endif

void MeansOfBlock(const Vec3* color, const float* coverage, std::ptrdiff_t stride, std::uint16_t pixels, Vec4* out) {
  for (unsigned left = pixels; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const std::ptrdiff_t at = (p >> 2) * stride + (p & 3);
    store_mean(color + 4 * at, coverage + 4 * at, &out[at].x);
  }
}

void MeansOfRow(const Vec3* color, const float* coverage, std::size_t pixels, float* out) {
  for (std::size_t i = 0; i < pixels; ++i) store_mean(color + 4 * i, coverage + 4 * i, out + 4 * i);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(MeansOfBlock);
HWY_EXPORT(MeansOfRow);

void means_of_block(const Vec3* color, const float* coverage, std::ptrdiff_t stride, std::uint16_t pixels, Vec4* out) {
  HWY_DYNAMIC_DISPATCH(MeansOfBlock)(color, coverage, stride, pixels, out);
}

void means_of_row(const Vec3* color, const float* coverage, std::size_t pixels, float* out) {
  HWY_DYNAMIC_DISPATCH(MeansOfRow)(color, coverage, pixels, out);
}

}  // namespace tessera::tilecore
#endif
