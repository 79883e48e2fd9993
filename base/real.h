#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera {

// Functions that programmable stages may call on their scalar type, besides + - * / and comparisons. SIMD lanes
// (simd-inl.h) and intervals bring their own overloads, found by argument-dependent lookup.
inline float real_sqrt(float a) { return std::sqrt(a); }
inline float real_abs(float a) { return std::abs(a); }
inline float real_min(float a, float b) { return b < a ? b : a; }
inline float real_max(float a, float b) { return a < b ? b : a; }
inline float real_floor(float a) { return std::floor(a); }
inline double real_sqrt(double a) { return std::sqrt(a); }
inline double real_abs(double a) { return std::abs(a); }
inline double real_min(double a, double b) { return b < a ? b : a; }
inline double real_max(double a, double b) { return a < b ? b : a; }
inline double real_floor(double a) { return std::floor(a); }
// a < b ? x : y, for every lane.
inline float select_less(float a, float b, float x, float y) { return a < b ? x : y; }
inline double select_less(double a, double b, double x, double y) { return a < b ? x : y; }

// Stages that branch by lane compute both sides and select. A comparison of floats is a bool, one of lanes a mask.
inline float select(bool mask, float x, float y) { return mask ? x : y; }
inline double select(bool mask, double x, double y) { return mask ? x : y; }
inline std::int32_t select(bool mask, std::int32_t x, std::int32_t y) { return mask ? x : y; }
inline bool any(bool mask) { return mask; }
inline bool all(bool mask) { return mask; }
inline bool both(bool a, bool b) { return a && b; }
// Neither infinite nor NaN.
inline bool is_finite(float a) { return real_abs(a) <= std::numeric_limits<float>::max(); }

// Whole numbers by lane; the argument must fit into 32 bits.
inline std::int32_t to_int(float a) { return static_cast<std::int32_t>(a); }
inline float to_float(std::int32_t a) { return static_cast<float>(a); }
inline float gather(const float* values, std::int32_t at) { return values[at]; }
inline std::int32_t gather(const std::int32_t* values, std::int32_t at) { return values[at]; }
inline std::int32_t shift_right(std::int32_t a, int by) {  // shifts in zeros, as for an unsigned number
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) >> by);
}
inline std::int32_t first_lane(std::int32_t a) { return a; }
inline void store_lanes(float a, float* to) { *to = a; }
inline void store_lanes(std::int32_t a, std::int32_t* to) { *to = a; }
inline std::int32_t bit_and(std::int32_t a, std::int32_t b) { return a & b; }

// 2^n for whole n in [-126, 127].
inline float power_of_two(float n) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(static_cast<std::int32_t>(n) + 127) << 23);
}
// a = mantissa 2^exponent with the mantissa in [1/sqrt(2), sqrt(2)), for normal a > 0.
inline void split_exponent(float a, float& mantissa, float& exponent) {
  const auto bits = std::bit_cast<std::int32_t>(a), base = std::int32_t{0x3F3504F3};  // sqrt(1/2)
  const std::int32_t e = (bits - base) >> 23;
  exponent = static_cast<float>(e);
  mantissa = std::bit_cast<float>(
      static_cast<std::int32_t>(static_cast<std::uint32_t>(bits) - (static_cast<std::uint32_t>(e) << 23)));
}

}  // namespace tessera
