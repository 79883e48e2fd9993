#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/real.h"
#include "base/vector3.h"

namespace tessera::frontend {

// A closed interval of reals that stands for a value a float shader computes: the result of each operation encloses
// what the operation gives on any members, *rounded to float or not*. Instantiating a stage written over `Real` with
// it bounds that stage over a whole domain, its single-precision rounding included.
//
// Endpoints are doubles; after each operation they move outwards by 2^-23 of their size (a float rounds by at most
// 2^-24, the endpoint's own rounding is far below) and by the smallest normal float. NaN becomes the whole line.
class Interval {
 public:
  Interval() = default;
  // NOLINTNEXTLINE: constants widen silently, as in the scalar shader
  Interval(double value) : low_(value), high_(value) {}
  Interval(float value) : Interval(static_cast<double>(value)) {}  // NOLINT
  Interval(int value) : Interval(static_cast<double>(value)) {}    // NOLINT
  Interval(double low, double high) : low_(low), high_(high) {}

  double low() const { return low_; }
  double high() const { return high_; }

  static Interval everything() { return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()}; }
  // The exact range [low, high] of an operation, widened.
  static Interval rounded(double low, double high) {
    if (std::isnan(low) || std::isnan(high)) return everything();
    return {low - std::abs(low) * 0x1p-23 - 0x1p-126, high + std::abs(high) * 0x1p-23 + 0x1p-126};
  }

 private:
  double low_ = 0, high_ = 0;
};

inline Interval operator+(const Interval& a, const Interval& b) { return Interval::rounded(a.low() + b.low(), a.high() + b.high()); }
inline Interval operator-(const Interval& a, const Interval& b) { return Interval::rounded(a.low() - b.high(), a.high() - b.low()); }
inline Interval operator*(const Interval& a, const Interval& b) {
  const double p = a.low() * b.low(), q = a.low() * b.high(), r = a.high() * b.low(), s = a.high() * b.high();
  // std::min would drop a NaN of 0 * infinity.
  if (std::isnan(p) || std::isnan(q) || std::isnan(r) || std::isnan(s)) return Interval::everything();
  return Interval::rounded(std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s)));
}
inline Interval operator/(const Interval& a, const Interval& b) {
  if (b.low() <= 0 && b.high() >= 0) return Interval::everything();
  return a * Interval::rounded(1 / b.high(), 1 / b.low());
}
// Of the members that are not negative; a value that may be negative makes the shader's result NaN.
inline Interval real_sqrt(const Interval& a) {
  if (!(a.low() >= 0)) return Interval::everything();
  return Interval::rounded(std::sqrt(a.low()), std::sqrt(a.high()));
}
inline Interval real_abs(const Interval& a) {
  if (a.low() >= 0) return a;
  if (a.high() <= 0) return {-a.high(), -a.low()};
  return {0, std::max(-a.low(), a.high())};
}
inline Interval real_min(const Interval& a, const Interval& b) { return {std::min(a.low(), b.low()), std::min(a.high(), b.high())}; }
inline Interval real_max(const Interval& a, const Interval& b) { return {std::max(a.low(), b.low()), std::max(a.high(), b.high())}; }

}  // namespace tessera::frontend
