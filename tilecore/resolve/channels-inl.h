// Four or eight floats at once, per target; include it inside kernel sources that use foreach_target.h.

#include <cstddef>

#include "base/simd-inl.h"
#include "base/vec.h"

#if defined(TESSERA_TILECORE_RESOLVE_CHANNELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_TILECORE_RESOLVE_CHANNELS_INL_H_
#undef TESSERA_TILECORE_RESOLVE_CHANNELS_INL_H_
#else
#define TESSERA_TILECORE_RESOLVE_CHANNELS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// N floats in one register, or in several where the target's are shorter. Element-wise, each operation rounded once:
// the same bits on every target.
template <std::size_t N>
struct Floats {
  using D = hn::CappedTag<float, N>;
  static constexpr std::size_t kLanes = hn::MaxLanes(D()), kParts = N / kLanes;
  hn::Vec<D> part[kParts];
};

// A colour's four channels, or a row of a block.
using Channels = Floats<4>;

template <std::size_t N>
HWY_INLINE Floats<N> splat(float value) {
  Floats<N> r;
  for (std::size_t i = 0; i < r.kParts; ++i) r.part[i] = hn::Set(typename Floats<N>::D(), value);
  return r;
}

HWY_INLINE Channels load(const float* four) {
  Channels r;
  for (std::size_t i = 0; i < Channels::kParts; ++i) r.part[i] = hn::LoadU(Channels::D(), four + i * Channels::kLanes);
  return r;
}
HWY_INLINE Channels load(const Vec4* color) { return load(&color->x); }

HWY_INLINE void store(Channels c, Vec4* color) {
  for (std::size_t i = 0; i < Channels::kParts; ++i)
    hn::StoreU(c.part[i], Channels::D(), &color->x + i * Channels::kLanes);
}

template <std::size_t N>
HWY_INLINE Floats<N> operator+(Floats<N> a, Floats<N> b) {
  for (std::size_t i = 0; i < a.kParts; ++i) a.part[i] = hn::Add(a.part[i], b.part[i]);
  return a;
}
template <std::size_t N>
HWY_INLINE Floats<N> operator-(Floats<N> a, Floats<N> b) {
  for (std::size_t i = 0; i < a.kParts; ++i) a.part[i] = hn::Sub(a.part[i], b.part[i]);
  return a;
}
template <std::size_t N>
HWY_INLINE Floats<N> operator*(Floats<N> a, float b) {
  for (std::size_t i = 0; i < a.kParts; ++i) a.part[i] = hn::Mul(a.part[i], hn::Set(typename Floats<N>::D(), b));
  return a;
}

// x - x is 0 for finite x, otherwise NaN.
template <std::size_t N>
HWY_INLINE bool is_finite(Floats<N> v) {
  const typename Floats<N>::D d;
  bool finite = true;
  for (const auto part : v.part) finite = hn::AllTrue(d, hn::Eq(hn::Sub(part, part), hn::Zero(d))) && finite;
  return finite;
}

}  // namespace HWY_NAMESPACE
}  // namespace tessera::tilecore
HWY_AFTER_NAMESPACE();

#endif
