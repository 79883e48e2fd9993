// Per-target vocabulary over Highway; include it inside kernel sources that use foreach_target.h.

#include <cmath>
#include <cstdint>
#include <cstring>

#include <hwy/highway.h>

#include "base/half_float.h"

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
HWY_INLINE FloatLanes real_floor(FloatLanes a) { return FloatLanes(hn::Floor(a.v)); }

// The functions of base/real.h on lanes, with the same results for NaN.
struct LaneMask {
  hn::Mask<FloatLanes::D> m;
};
HWY_INLINE LaneMask operator<(FloatLanes a, FloatLanes b) { return {hn::Lt(a.v, b.v)}; }
HWY_INLINE LaneMask operator>(FloatLanes a, FloatLanes b) { return {hn::Gt(a.v, b.v)}; }
HWY_INLINE LaneMask operator<=(FloatLanes a, FloatLanes b) { return {hn::Le(a.v, b.v)}; }
HWY_INLINE LaneMask operator>=(FloatLanes a, FloatLanes b) { return {hn::Ge(a.v, b.v)}; }
HWY_INLINE LaneMask operator==(FloatLanes a, FloatLanes b) { return {hn::Eq(a.v, b.v)}; }
HWY_INLINE bool any(LaneMask a) { return !hn::AllFalse(FloatLanes::D(), a.m); }
HWY_INLINE bool all(LaneMask a) { return hn::AllTrue(FloatLanes::D(), a.m); }
HWY_INLINE LaneMask both(LaneMask a, LaneMask b) { return {hn::And(a.m, b.m)}; }
HWY_INLINE FloatLanes select(LaneMask mask, FloatLanes x, FloatLanes y) {
  return FloatLanes(hn::IfThenElse(mask.m, x.v, y.v));
}
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
// x86's minimum and maximum are these very selections: the second operand where neither is less.
HWY_INLINE FloatLanes real_min(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Min(b.v, a.v)); }
HWY_INLINE FloatLanes real_max(FloatLanes a, FloatLanes b) { return FloatLanes(hn::Max(b.v, a.v)); }
#else
HWY_INLINE FloatLanes real_min(FloatLanes a, FloatLanes b) { return select(b < a, b, a); }
HWY_INLINE FloatLanes real_max(FloatLanes a, FloatLanes b) { return select(a < b, b, a); }
#endif
HWY_INLINE FloatLanes select_less(FloatLanes a, FloatLanes b, FloatLanes x, FloatLanes y) {
  return select(a < b, x, y);
}
HWY_INLINE LaneMask is_finite(FloatLanes a) { return real_abs(a) <= FloatLanes(3.40282346638528859812e38f); }

struct IntLanes {
  using D = hn::RebindToSigned<FloatLanes::D>;
  hn::Vec<D> v;

  IntLanes() : v(hn::Zero(D())) {}
  IntLanes(std::int32_t value) : v(hn::Set(D(), value)) {}  // NOLINT: as FloatLanes
  explicit IntLanes(hn::Vec<D> lanes) : v(lanes) {}
  static IntLanes load(const std::int32_t* values) { return IntLanes(hn::LoadU(D(), values)); }
  void store(std::int32_t* values) const { hn::StoreU(v, D(), values); }
};
HWY_INLINE IntLanes operator+(IntLanes a, IntLanes b) { return IntLanes(hn::Add(a.v, b.v)); }
HWY_INLINE IntLanes operator-(IntLanes a, IntLanes b) { return IntLanes(hn::Sub(a.v, b.v)); }
HWY_INLINE IntLanes operator*(IntLanes a, IntLanes b) { return IntLanes(hn::Mul(a.v, b.v)); }
HWY_INLINE LaneMask operator<(IntLanes a, IntLanes b) { return {hn::RebindMask(FloatLanes::D(), hn::Lt(a.v, b.v))}; }
HWY_INLINE LaneMask operator>=(IntLanes a, IntLanes b) {
  return {hn::RebindMask(FloatLanes::D(), hn::Not(hn::Lt(a.v, b.v)))};
}
HWY_INLINE LaneMask operator==(IntLanes a, IntLanes b) { return {hn::RebindMask(FloatLanes::D(), hn::Eq(a.v, b.v))}; }
HWY_INLINE IntLanes select(LaneMask mask, IntLanes x, IntLanes y) {
  return IntLanes(hn::IfThenElse(hn::RebindMask(IntLanes::D(), mask.m), x.v, y.v));
}
HWY_INLINE IntLanes to_int(FloatLanes a) { return IntLanes(hn::ConvertTo(IntLanes::D(), a.v)); }
HWY_INLINE FloatLanes to_float(IntLanes a) { return FloatLanes(hn::ConvertTo(FloatLanes::D(), a.v)); }
HWY_INLINE FloatLanes gather(const float* values, IntLanes at) {
  return FloatLanes(hn::GatherIndex(FloatLanes::D(), values, at.v));
}
HWY_INLINE IntLanes gather(const std::int32_t* values, IntLanes at) {
  return IntLanes(hn::GatherIndex(IntLanes::D(), values, at.v));
}
HWY_INLINE IntLanes shift_right(IntLanes a, int by) {
  const hn::RebindToUnsigned<FloatLanes::D> du;
  return IntLanes(hn::BitCast(IntLanes::D(), hn::ShiftRightSame(hn::BitCast(du, a.v), by)));
}
HWY_INLINE std::int32_t first_lane(IntLanes a) { return hn::GetLane(a.v); }
HWY_INLINE void store_lanes(FloatLanes a, float* to) { a.store(to); }
HWY_INLINE void store_lanes(IntLanes a, std::int32_t* to) { a.store(to); }
HWY_INLINE IntLanes bit_and(IntLanes a, IntLanes b) { return IntLanes(hn::And(a.v, b.v)); }

HWY_INLINE FloatLanes power_of_two(FloatLanes n) {
  const IntLanes biased = to_int(n) + IntLanes(127);
  return FloatLanes(hn::BitCast(FloatLanes::D(), hn::ShiftLeft<23>(biased.v)));
}
HWY_INLINE void split_exponent(FloatLanes a, FloatLanes& mantissa, FloatLanes& exponent) {
  const IntLanes::D d;
  const IntLanes bits(hn::BitCast(d, a.v)), base(0x3F3504F3);
  const IntLanes e(hn::ShiftRight<23>((bits - base).v));
  exponent = to_float(e);
  mantissa = FloatLanes(hn::BitCast(FloatLanes::D(), hn::Sub(bits.v, hn::ShiftLeft<23>(e.v))));
}

// Lane by lane: for a precision that is studied, not for the common one.
HWY_INLINE FloatLanes round_to_half(FloatLanes a) {
  alignas(64) float values[hn::MaxLanes(FloatLanes::D())];
  a.store(values);
  for (std::size_t i = 0; i < FloatLanes::count(); ++i) values[i] = tessera::round_to_half(values[i]);
  return FloatLanes::load(values);
}

#include "base/vector3.inc"

}  // namespace HWY_NAMESPACE
}  // namespace tessera
HWY_AFTER_NAMESPACE();

#endif
