// Per-target vocabulary over Highway; include it inside kernel sources that use foreach_target.h.

#include <cmath>
#include <cstdint>
#include <cstring>

#include <hwy/highway.h>

#if defined(TESSERA_BASE_SIMD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_BASE_SIMD_INL_H_
#undef TESSERA_BASE_SIMD_INL_H_
#else
#define TESSERA_BASE_SIMD_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// a * b + c with one rounding on every target, so that results do not depend on the host. Highway's MulAdd is
// unfused where the target has no such instruction; there std::fma takes its place, lane by lane.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V fused_multiply_add(D d, V a, V b, V c) {
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
  alignas(64) hn::TFromD<D> x[hn::MaxLanes(D())], y[hn::MaxLanes(D())], z[hn::MaxLanes(D())];
  hn::Store(a, d, x);
  hn::Store(b, d, y);
  hn::Store(c, d, z);
  for (size_t i = 0; i < hn::Lanes(d); ++i) x[i] = std::fma(x[i], y[i], z[i]);
  return hn::Load(d, x);
#else
  (void)d;
  return hn::MulAdd(a, b, c);
#endif
}

// One bit per lane, lane 0 the lowest; at most 32 lanes.
template <class D, class M>
HWY_INLINE std::uint32_t mask_bits(D d, M mask) {
  std::uint8_t bytes[8] = {};  // as many as StoreMaskBits() may write
  hn::StoreMaskBits(d, mask, bytes);
  std::uint32_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits;
}

// Lanes of float with operators, so that a shader written over `Real` runs on all lanes at once. Operations round
// once each, as the scalar ones do; nothing is fused.
struct FloatLanes {
  using D = hn::ScalableTag<float>;
  hn::Vec<D> v;

  FloatLanes() : v(hn::Zero(D())) {}
  FloatLanes(float value) : v(hn::Set(D(), value)) {}  // NOLINT: scalars widen silently, as in the scalar shader
  explicit FloatLanes(hn::Vec<D> lanes) : v(lanes) {}
  static FloatLanes load(const float* values) { return FloatLanes(hn::LoadU(D(), values)); }
  void store(float* values) const { hn::StoreU(v, D(), values); }
  static size_t count() { return hn::Lanes(D()); }
};

// Free functions, not friends defined in the class: GCC 12 compiles those without the region's target.
HWY_INLINE FloatLanes operator+(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Add(a.v, b.v)); }
HWY_INLINE FloatLanes operator-(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Sub(a.v, b.v)); }
HWY_INLINE FloatLanes operator*(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Mul(a.v, b.v)); }
HWY_INLINE FloatLanes operator/(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Div(a.v, b.v)); }
HWY_INLINE FloatLanes real_sqrt(FloatLanes a) { return FloatLanes(hn::Sqrt(a.v)); }
HWY_INLINE FloatLanes real_abs(FloatLanes a) { return FloatLanes(hn::Abs(a.v)); }
// As base/real.h, NaN included.
HWY_INLINE FloatLanes real_max(FloatLanes a, FloatLanes b) {
  return FloatLanes(hn::IfThenElse(hn::Lt(a.v, b.v), b.v, a.v));
}

#include "base/vector3.inc"

}  // namespace HWY_NAMESPACE
}  // namespace tessera
HWY_AFTER_NAMESPACE();

#endif
