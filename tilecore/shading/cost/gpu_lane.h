#pragma once

// One lane of a GPU of the gfx1030 ISA as the scalar type of shaders: operations of stages map to the hardware's own.
// Only make_costs.py compiles it.

#include <cstdint>

#include "base/real.h"
#include "base/vector3.h"

namespace tessera::gpu_lane {

// A comparison. Shaders that test all lanes follow the assumed path: all lanes are in the common case (a patch's normal
// is regular), and a branch that any lane may need is executed.
struct LaneMask {
  bool m;
};
inline bool any(LaneMask) { return true; }
inline bool all(LaneMask) { return true; }
inline LaneMask both(LaneMask a, LaneMask b) { return {a.m && b.m}; }
// Whether lanes have the same number. This is no common case but depends on their reads: `kSame` decides.
template <bool kSame>
struct EqualMask : LaneMask {};
template <bool kSame>
bool all(EqualMask<kSame>) {
  return kSame;
}

// Keeps the varying part and the part known at compile time separate: the latter goes into instructions as an offset.
template <bool kSame>
struct IntLane {
  std::int32_t varying = 0, known = 0;
  IntLane() = default;
  IntLane(std::int32_t value) : known(value) {}  // NOLINT: as IntLanes
  static IntLane of(std::int32_t value) {
    IntLane a;
    a.varying = value;
    return a;
  }
  std::int32_t sum() const { return varying + known; }
  friend IntLane operator+(IntLane a, IntLane b) {
    a.varying += b.varying, a.known += b.known;
    return a;
  }
  friend IntLane operator*(IntLane a, IntLane b) {
    a.varying = a.varying * b.varying + a.varying * b.known + a.known * b.varying;
    a.known *= b.known;
    return a;
  }
  friend LaneMask operator<(IntLane a, IntLane b) { return {a.sum() < b.sum()}; }
  friend LaneMask operator>=(IntLane a, IntLane b) { return {a.sum() >= b.sum()}; }
  friend EqualMask<kSame> operator==(IntLane a, IntLane b) { return {{a.sum() == b.sum()}}; }
  friend IntLane select(LaneMask mask, IntLane x, IntLane y) { return of(mask.m ? x.sum() : y.sum()); }
  friend IntLane shift_right(IntLane a, int by) { return of(tessera::shift_right(a.sum(), by)); }
  friend IntLane bit_and(IntLane a, IntLane b) { return of(a.sum() & b.sum()); }
  friend std::int32_t first_lane(IntLane a) { return __builtin_amdgcn_readfirstlane(a.sum()); }
  friend void store_lanes(IntLane a, std::int32_t* to) { *to = a.sum(); }
};

// `kSame`: numbers that are compared for equality are the same in all lanes of a warp.
template <bool kSame>
struct Lane {
  float v = 0;
  Lane() = default;
  Lane(float value) : v(value) {}  // NOLINT: as FloatLanes
  using Int = IntLane<kSame>;
  friend Lane operator+(Lane a, Lane b) { return a.v + b.v; }
  friend Lane operator-(Lane a, Lane b) { return a.v - b.v; }
  friend Lane operator*(Lane a, Lane b) { return a.v * b.v; }
  friend Lane operator/(Lane a, Lane b) { return a.v / b.v; }
  friend LaneMask operator<(Lane a, Lane b) { return {a.v < b.v}; }
  friend LaneMask operator>(Lane a, Lane b) { return {a.v > b.v}; }
  friend LaneMask operator<=(Lane a, Lane b) { return {a.v <= b.v}; }
  friend LaneMask operator>=(Lane a, Lane b) { return {a.v >= b.v}; }
  friend EqualMask<kSame> operator==(Lane a, Lane b) { return {{a.v == b.v}}; }
  friend Lane select(LaneMask mask, Lane x, Lane y) { return mask.m ? x : y; }
  friend LaneMask is_finite(Lane a) { return {tessera::is_finite(a.v)}; }
  friend Lane real_sqrt(Lane a) { return __builtin_sqrtf(a.v); }
  friend Lane real_abs(Lane a) { return __builtin_fabsf(a.v); }
  friend Lane real_floor(Lane a) { return __builtin_floorf(a.v); }
  friend Lane real_min(Lane a, Lane b) { return __builtin_fminf(a.v, b.v); }
  friend Lane real_max(Lane a, Lane b) { return __builtin_fmaxf(a.v, b.v); }
  friend Int to_int(Lane a) { return Int::of(static_cast<std::int32_t>(a.v)); }
};
template <bool kSame>
Lane<kSame> to_float(IntLane<kSame> a) {
  return static_cast<float>(a.sum());
}
// Reads as from a buffer: a base in scalar registers, a 32-bit offset in bytes, and one in the instruction.
template <class T, bool kSame>
T read_buffer(const T* values, IntLane<kSame> at) {
  const auto bytes = static_cast<std::uint32_t>(at.varying) * static_cast<std::uint32_t>(sizeof(T));
  return *reinterpret_cast<const T*>(reinterpret_cast<const char*>(values + at.known) + bytes);
}
template <bool kSame>
Lane<kSame> gather(const float* values, IntLane<kSame> at) {
  return read_buffer(values, at);
}
template <bool kSame>
IntLane<kSame> gather(const std::int32_t* values, IntLane<kSame> at) {
  return IntLane<kSame>::of(read_buffer(values, at));
}
template <bool kSame>
Lane<kSame> round_to_half(Lane<kSame> a) {
  return static_cast<float>(static_cast<_Float16>(a.v));
}

}  // namespace tessera::gpu_lane
