// Procedures for the SIMD target in force; for kernel sources that use foreach_target.h. See procedures.h.

#include <array>
#include <string_view>
#include <type_traits>

#include "base/simd-inl.h"
#include "shaders_cpp/procedures/declarations.h"
#include "shaders_cpp/procedures/program.h"
#include "shaders_cpp/procedures/scalar.h"
#include "shaders_cpp/procedures/uniforms.h"

#if defined(TESSERA_SHADERS_CPP_PROCEDURES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SHADERS_CPP_PROCEDURES_INL_H_
#undef TESSERA_SHADERS_CPP_PROCEDURES_INL_H_
#else
#define TESSERA_SHADERS_CPP_PROCEDURES_INL_H_
#endif

#define TESSERA_STAGE_ATTR HWY_ATTR
#define TESSERA_STAGE_NOINLINE HWY_NOINLINE
HWY_BEFORE_NAMESPACE();
namespace tessera {
namespace shaders {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using tessera::HWY_NAMESPACE::cross;
using tessera::HWY_NAMESPACE::dot;
using tessera::HWY_NAMESPACE::FloatLanes;
using tessera::HWY_NAMESPACE::Vector3;

// ---- Functions of scalar.h for lanes, with the same bits --------------------------------------------------------

using IntTag = hn::RebindToSigned<FloatLanes::D>;
using UnsignedTag = hn::RebindToUnsigned<FloatLanes::D>;
using UnsignedLanes = hn::Vec<UnsignedTag>;

HWY_INLINE UnsignedLanes mix32_lanes(UnsignedLanes x) {
  const UnsignedTag d;
  x = hn::Xor(x, hn::ShiftRight<16>(x));
  x = hn::Mul(x, hn::Set(d, 0x7feb352du));
  x = hn::Xor(x, hn::ShiftRight<15>(x));
  x = hn::Mul(x, hn::Set(d, 0x846ca68bu));
  return hn::Xor(x, hn::ShiftRight<16>(x));
}
HWY_INLINE UnsignedLanes hash32_lanes(UnsignedLanes a, UnsignedLanes b, UnsignedLanes c) {
  return mix32_lanes(mix32_lanes(hn::Add(mix32_lanes(hn::Add(mix32_lanes(a), b)), c)));
}
// Whole numbers up to 2^24, which floats hold exactly.
HWY_INLINE FloatLanes float_of(UnsignedLanes x) {
  return FloatLanes(hn::ConvertTo(FloatLanes::D(), hn::BitCast(IntTag(), x)));
}

#include "shaders_cpp/procedures/functions.inc"

HWY_INLINE void real_sincos_turns(FloatLanes turns, FloatLanes& sine, FloatLanes& cosine) {
  sincos_by_series(turns, sine, cosine);
}

HWY_INLINE PlaneNoise<FloatLanes> plane_noise_with_slopes(FloatLanes x, FloatLanes y) {
  const UnsignedTag du;
  const FloatLanes::D d;
  const FloatLanes column = real_floor(x), row = real_floor(y);
  const auto inside = hn::And(hn::Lt(hn::Abs(column.v), hn::Set(d, 1e9f)), hn::Lt(hn::Abs(row.v), hn::Set(d, 1e9f)));
  const auto whole = [&](FloatLanes a)
                         HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(IntTag(), hn::IfThenElseZero(inside, a.v))); };
  const UnsignedLanes i = whole(column), j = whole(row);
  FloatLanes gx[4], gy[4];
  for (std::uint32_t k = 0; k < 4; ++k) {
    const UnsignedLanes h =
        hash32_lanes(hn::Add(i, hn::Set(du, k & 1u)), hn::Add(j, hn::Set(du, k >> 1)), hn::Zero(du));
    gx[k] = float_of(hn::And(h, hn::Set(du, 0xFFFFu))) * FloatLanes(0x1p-15f) - FloatLanes(1.0f);
    gy[k] = float_of(hn::ShiftRight<16>(h)) * FloatLanes(0x1p-15f) - FloatLanes(1.0f);
  }
  const PlaneNoise<FloatLanes> n = noise_in_cell<FloatLanes>(x - column, y - row, gx, gy);
  const auto kept = [&](FloatLanes a) HWY_ATTR { return FloatLanes(hn::IfThenElseZero(inside, a.v)); };
  return {kept(n.value), kept(n.by_x), kept(n.by_y)};
}
HWY_INLINE FloatLanes plane_noise(FloatLanes x, FloatLanes y) { return plane_noise_with_slopes(x, y).value; }

HWY_INLINE PlaneNoise<FloatLanes> image_value_with_slopes(const float* values, int width, int height, FloatLanes u,
                                                          FloatLanes v) {
  const FloatLanes::D d;
  const IntTag di;
  const FloatLanes su(static_cast<float>(width - 1)), sv(static_cast<float>(height - 1)), none(0.0f), one(1.0f);
  // Like std::max and std::min, which keep their first argument when a comparison fails: a NaN coordinate stays NaN,
  // and its lane must not access memory.
  const auto clamped = [&](FloatLanes a, FloatLanes most)
                           HWY_ATTR { return real_min(tessera::HWY_NAMESPACE::real_max(a, none), most); };
  const FloatLanes x = clamped(u * su, su), y = clamped(v * sv, sv);
  const FloatLanes column = real_min(real_floor(x), su - one), row = real_min(real_floor(y), sv - one), fx = x - column,
                   fy = y - row;
  const auto number = [&](FloatLanes a) HWY_ATTR { return hn::IfThenElseZero(hn::Eq(a.v, a.v), a.v); };
  const hn::Vec<IntTag> at =
      hn::Add(hn::Mul(hn::ConvertTo(di, number(row)), hn::Set(di, width)), hn::ConvertTo(di, number(column)));
  const auto corner = [&](int offset) HWY_ATTR { return FloatLanes(hn::GatherIndex(d, values + offset, at)); };
  const FloatLanes c00 = corner(0), c10 = corner(1), c01 = corner(width), c11 = corner(width + 1), gx = one - fx,
                   gy = one - fy;
  return {(c00 * gx + c10 * fx) * gy + (c01 * gx + c11 * fx) * fy, ((c10 - c00) * gy + (c11 - c01) * fy) * su,
          ((c01 - c00) * gx + (c11 - c10) * fx) * sv};
}
HWY_INLINE FloatLanes image_value(const float* values, int width, int height, FloatLanes u, FloatLanes v) {
  return image_value_with_slopes(values, width, height, u, v).value;
}

// Declared here for the textures; defined below, since it uses one of their functions.
HWY_INLINE FloatLanes space_noise(FloatLanes x, FloatLanes y, FloatLanes z);

// Each file needs the files before it.
// clang-format off
#include "shaders_cpp/procedures/dual.inc"
#include "shaders_cpp/procedures/shapes.inc"
#include "shaders_cpp/procedures/textures.inc"
#include "shaders_cpp/procedures/shading.inc"
#include "shaders_cpp/procedures/program.inc"
#include "shaders_cpp/procedures/stages.inc"
// clang-format on

HWY_INLINE FloatLanes space_noise(FloatLanes x, FloatLanes y, FloatLanes z) {
  const UnsignedTag du;
  const FloatLanes::D d;
  const FloatLanes fx = real_floor(x), fy = real_floor(y), fz = real_floor(z);
  const auto limit = hn::Set(d, 1e9f);
  const auto inside =
      hn::And(hn::Lt(hn::Abs(fx.v), limit), hn::And(hn::Lt(hn::Abs(fy.v), limit), hn::Lt(hn::Abs(fz.v), limit)));
  const auto whole = [&](FloatLanes a)
                         HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(IntTag(), hn::IfThenElseZero(inside, a.v))); };
  const UnsignedLanes i = whole(fx), j = whole(fy), k = whole(fz);
  FloatLanes corner[8];
  for (std::uint32_t c = 0; c < 8; ++c) {
    const UnsignedLanes h = hash32_lanes(hn::Add(i, hn::Set(du, c & 1u)), hn::Add(j, hn::Set(du, c >> 1 & 1u)),
                                         hn::Add(k, hn::Set(du, c >> 2)));
    corner[c] = float_of(hn::ShiftRight<8>(h)) * FloatLanes(0x1p-23f) - FloatLanes(1.0f);
  }
  const FloatLanes n = mix_corners(corner, smooth_step(x - fx), smooth_step(y - fy), smooth_step(z - fz));
  return FloatLanes(hn::IfThenElseZero(inside, n.v));
}

}  // namespace HWY_NAMESPACE
}  // namespace shaders
}  // namespace tessera
HWY_AFTER_NAMESPACE();
#undef TESSERA_STAGE_ATTR
#undef TESSERA_STAGE_NOINLINE

#endif
