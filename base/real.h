#pragma once

#include <algorithm>
#include <cmath>

namespace tessera {

// What programmable stages may ask of their scalar type besides + - * /. SIMD lanes and intervals bring their own
// overloads, found by argument-dependent lookup.
inline float real_sqrt(float a) { return std::sqrt(a); }
inline float real_abs(float a) { return std::abs(a); }
inline float real_min(float a, float b) { return b < a ? b : a; }
inline float real_max(float a, float b) { return a < b ? b : a; }
inline float real_exp2(float a) { return std::exp2(a); }
inline double real_sqrt(double a) { return std::sqrt(a); }
inline double real_abs(double a) { return std::abs(a); }
inline double real_min(double a, double b) { return b < a ? b : a; }
inline double real_max(double a, double b) { return a < b ? b : a; }
inline double real_exp2(double a) { return std::exp2(a); }

}  // namespace tessera
