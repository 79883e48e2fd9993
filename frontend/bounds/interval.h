#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::frontend {

// A closed interval of reals. An operation's result holds its value for all members of its operands; endpoints are
// doubles that move outwards by more than they round. NaN becomes the whole line.
class Interval {
 public:
  Interval() = default;
  Interval(double value) : low_(value), high_(value) {}            // NOLINT: a number is an interval
  Interval(float value) : Interval(static_cast<double>(value)) {}  // NOLINT
  Interval(double low, double high) : low_(low), high_(high) {}

  double low() const { return low_; }
  double high() const { return high_; }
  double magnitude() const { return std::max(std::abs(low_), std::abs(high_)); }

  static Interval everything() {
    return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  // The exact range of an operation, widened by its rounding and by at least 1e-80, which keeps products away from
  // denormals.
  static Interval rounded(double low, double high) {
    if (std::isnan(low) || std::isnan(high)) return everything();
    return {low - std::abs(low) * 0x1p-51 - 1e-80, high + std::abs(high) * 0x1p-51 + 1e-80};
  }

 private:
  double low_ = 0, high_ = 0;
};

inline Interval operator+(const Interval& a, const Interval& b) {
  return Interval::rounded(a.low() + b.low(), a.high() + b.high());
}
inline Interval operator-(const Interval& a, const Interval& b) {
  return Interval::rounded(a.low() - b.high(), a.high() - b.low());
}
inline Interval operator*(const Interval& a, const Interval& b) {
  const double p = a.low() * b.low(), q = a.low() * b.high(), r = a.high() * b.low(), s = a.high() * b.high();
  // std::min would drop a NaN of 0 * infinity.
  if (std::isnan(p) || std::isnan(q) || std::isnan(r) || std::isnan(s)) return Interval::everything();
  return Interval::rounded(std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s)));
}
inline Interval operator/(const Interval& a, const Interval& b) {
  if (!(b.low() > 0 || b.high() < 0)) return Interval::everything();
  return a * Interval::rounded(1 / b.high(), 1 / b.low());
}
// The whole line when a member is negative.
inline Interval square_root(const Interval& a) {
  if (!(a.low() >= 0)) return Interval::everything();
  return Interval::rounded(std::sqrt(a.low()), std::sqrt(a.high()));
}
inline Interval absolute(const Interval& a) {
  if (a.low() >= 0) return a;
  if (a.high() <= 0) return {-a.high(), -a.low()};
  return {0, a.magnitude()};
}
inline Interval hull(const Interval& a, const Interval& b) {
  return {std::min(a.low(), b.low()), std::max(a.high(), b.high())};
}
// Intersection of two intervals that both hold the value.
inline Interval both(const Interval& a, const Interval& b) {
  return {std::max(a.low(), b.low()), std::min(a.high(), b.high())};
}

}  // namespace tessera::frontend
