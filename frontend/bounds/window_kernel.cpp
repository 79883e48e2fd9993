#include "frontend/bounds/window_places.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "frontend/bounds/window_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

// Every lane does the operations of MinMaxPyramid's own lookups (inner_texels) and of WindowTable::over, in their order;
// nothing is fused.
HWY_BEFORE_NAMESPACE();
namespace tessera::frontend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;
using DI = hn::Rebind<std::int32_t, D>;
using DF = hn::Rebind<float, D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
constexpr D kD;
constexpr DI kI;
constexpr DF kF;

struct Texels {
  VI first, last;
  hn::Mask<D> inside;
};
HWY_INLINE Texels InnerTexels(const PlaceAxis& axis, std::size_t k) {
  const auto set = [](double x) HWY_ATTR { return hn::Set(kD, x); };
  V from = hn::PromoteTo(kD, hn::LoadU(kF, axis.low.data() + k)),
    to = hn::PromoteTo(kD, hn::LoadU(kF, axis.high.data() + k));
  const auto usable = hn::And(hn::Lt(hn::Abs(from), set(1e9)), hn::Lt(hn::Abs(to), set(1e9)));
  from = hn::IfThenElseZero(usable, from), to = hn::IfThenElseZero(usable, to);
  const V size = hn::PromoteTo(kD, hn::LoadU(kI, axis.size.data() + k));
  const V slack = hn::Add(hn::Mul(hn::Mul(set(0x1p-20), size), hn::Add(hn::Add(set(1), hn::Abs(from)), hn::Abs(to))),
                          set(0x1p-10)),
          margin = hn::Add(set(0.5), slack);
  if (axis.repeats) {
    const V period = hn::Floor(from);
    from = hn::Sub(from, period);
    to = hn::Sub(to, period);
  }
  const V low = hn::Sub(hn::Mul(from, size), margin), high = hn::Add(hn::Mul(to, size), margin);
  const auto inside = hn::And(usable, hn::And(hn::Ge(low, hn::Zero(kD)), hn::Lt(high, size)));
  return {hn::DemoteTo(kI, hn::IfThenElseZero(inside, low)), hn::DemoteTo(kI, hn::IfThenElseZero(inside, high)),
          inside};
}

// Floor of log2 of numbers from 1 to 2^24.
HWY_INLINE VI Log2Below(VI n) {
  const VI bits = hn::BitCast(kI, hn::ConvertTo(kF, n));
  return hn::Sub(hn::ShiftRight<23>(bits), hn::Set(kI, 127));
}

struct Windows {
  VI first, last;
};
HWY_INLINE Windows Span(const Texels& texels, VI size, VI log2_side, VI log2_apart) {
  const VI zero = hn::Zero(kI), one = hn::Set(kI, 1), side = hn::Shl(one, log2_side), apart = hn::Shl(one, log2_apart);
  const VI rest = hn::Sub(size, side);
  const VI beyond = hn::Shr(hn::Add(hn::Max(rest, zero), hn::Sub(apart, one)), log2_apart);  // windows but the first
  const VI first = hn::Min(hn::Shr(texels.first, log2_apart), hn::IfThenElseZero(hn::Gt(rest, zero), beyond));
  const VI reach = hn::Sub(hn::Add(texels.last, apart), side);
  const VI last = hn::Max(first, hn::Shr(hn::Max(reach, zero), log2_apart));
  return {first, last};
}

void FindWindows(WindowPlaces& places, std::size_t count) {
  const VI one = hn::Set(kI, 1);
  for (std::size_t k = 0; k < count; k += hn::Lanes(kD)) {
    const Texels s = InnerTexels(places.s, k), t = InnerTexels(places.t, k);
    const VI width = hn::Add(hn::Sub(s.last, s.first), one), height = hn::Add(hn::Sub(t.last, t.first), one);
    const VI longer = hn::Or(hn::Sub(hn::Max(width, height), one), one);
    VI log2_side = hn::Max(Log2Below(hn::Min(width, height)), hn::Max(hn::Sub(Log2Below(longer), one), one));
    log2_side = hn::Min(log2_side, hn::LoadU(kI, places.steps.data() + k));
    const VI log2_apart = hn::Max(hn::Sub(log2_side, hn::Set(kI, 2)), hn::Zero(kI));
    const Windows columns = Span(s, hn::LoadU(kI, places.s.size.data() + k), log2_side, log2_apart),
                  rows = Span(t, hn::LoadU(kI, places.t.size.data() + k), log2_side, log2_apart);
    hn::StoreU(columns.first, kI, places.s.first.data() + k);
    hn::StoreU(columns.last, kI, places.s.last.data() + k);
    hn::StoreU(rows.first, kI, places.t.first.data() + k);
    hn::StoreU(rows.last, kI, places.t.last.data() + k);
    hn::StoreU(hn::Sub(log2_side, one), kI, places.step.data() + k);
    const VI inside = hn::DemoteTo(kI, hn::IfThenElseZero(hn::And(s.inside, t.inside), hn::Set(kD, 1.0)));
    hn::StoreU(inside, kI, places.found.data() + k);
  }
}

}  // namespace tessera::frontend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::frontend {

HWY_EXPORT(FindWindows);

void find_windows(WindowPlaces& places, std::size_t count) { HWY_DYNAMIC_DISPATCH(FindWindows)(places, count); }

}  // namespace tessera::frontend
#endif
