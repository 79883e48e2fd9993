#pragma once

#include <cmath>

#include "base/vector3.h"
#include "frontend/bounds/interval.h"

namespace tessera::frontend {

// A `Real` that bounds the results of a stage over a box of its parameters: instantiate the stage with it and read the
// bounds off the result. It works for every stage written over Real, with or without hand-made bounds.
//
// It carries the range over the box, the value at its middle, the ranges of the derivatives by both parameters (each
// scaled to [-1, 1]), and the largest distance of the machine's single-precision result from the exact one. The range
// is the result of interval arithmetic, intersected with the mean value theorem's, middle + derivative * [-1, 1].
// Interval arithmetic ignores that two uses of a parameter vary together; its error shrinks with the box, the mean
// value theorem's with the square of the box.
class Enclosure {
 public:
  Enclosure() = default;
  // NOLINTNEXTLINE: constants widen silently, as in the scalar shader
  Enclosure(double value) : range_(value), middle_(value), by_s_(0.0), by_t_(0.0) {}
  Enclosure(float value) : Enclosure(static_cast<double>(value)) {}  // NOLINT
  Enclosure(int value) : Enclosure(static_cast<double>(value)) {}    // NOLINT
  Enclosure(const Interval& range, const Interval& middle, const Interval& by_s, const Interval& by_t, double error)
      : range_(both(range, middle + by_s * Interval(-1, 1) + by_t * Interval(-1, 1))),
        middle_(middle),
        by_s_(by_s),
        by_t_(by_t),
        error_(error) {
    if (!(range_.low() <= range_.high())) range_ = range;  // both are sound; NaN and rounding must not make it empty
  }

  // The first or second parameter, anywhere in [low, high].
  static Enclosure first_parameter(double low, double high) {
    return {Interval(low, high), (low + high) / 2, (high - low) / 2, 0.0, 0};
  }
  static Enclosure second_parameter(double low, double high) {
    return {Interval(low, high), (low + high) / 2, 0.0, (high - low) / 2, 0};
  }
  // A value known only by its range; its dependence on the parameters is unknown.
  static Enclosure anything_in(double low, double high) {
    const double half = (high - low) / 2;
    return {Interval(low, high), Interval(low, high), Interval(-half, half), 0.0, 0};
  }

  // The same value, computed less exactly than its operations suggest.
  Enclosure with_error(double more) const { return {range_, middle_, by_s_, by_t_, error_ + more}; }

  const Interval& range() const { return range_; }
  const Interval& middle() const { return middle_; }
  const Interval& by_s() const { return by_s_; }
  const Interval& by_t() const { return by_t_; }
  double error() const { return error_; }

  // Bounds of the single-precision result.
  double low() const { return range_.low() - error_; }
  double high() const { return range_.high() + error_; }

 private:
  Interval range_, middle_, by_s_, by_t_;
  double error_ = 0;
};

// A float operation rounds by at most 2^-24 of its result, and by half the smallest denormal.
inline double rounding_of(const Interval& result) { return result.magnitude() * 0x1p-24 + 0x1p-149; }

inline Enclosure operator+(const Enclosure& a, const Enclosure& b) {
  const Interval range = a.range() + b.range();
  const double error = a.error() + b.error();
  return {range, a.middle() + b.middle(), a.by_s() + b.by_s(), a.by_t() + b.by_t(), error * 1.001 + rounding_of(range)};
}
inline Enclosure operator-(const Enclosure& a, const Enclosure& b) {
  const Interval range = a.range() - b.range();
  const double error = a.error() + b.error();
  return {range, a.middle() - b.middle(), a.by_s() - b.by_s(), a.by_t() - b.by_t(), error * 1.001 + rounding_of(range)};
}
inline Enclosure operator*(const Enclosure& a, const Enclosure& b) {
  const Interval range = a.range() * b.range();
  const double error = a.range().magnitude() * b.error() + b.range().magnitude() * a.error() + a.error() * b.error();
  return {range, a.middle() * b.middle(), a.by_s() * b.range() + a.range() * b.by_s(),
          a.by_t() * b.range() + a.range() * b.by_t(), error * 1.001 + rounding_of(range)};
}
inline Enclosure operator/(const Enclosure& a, const Enclosure& b) {
  const Interval range = a.range() / b.range();
  const double least = absolute(b.range()).low() - b.error();
  const double error =
      least > 0 ? (a.error() + range.magnitude() * b.error()) / least : std::numeric_limits<double>::infinity();
  return {range, a.middle() / b.middle(), (a.by_s() - range * b.by_s()) / b.range(),
          (a.by_t() - range * b.by_t()) / b.range(), error * 1.001 + rounding_of(range)};
}
inline Enclosure real_sqrt(const Enclosure& a) {
  const Interval range = square_root(a.range()), twice = range * Interval(2.0);
  const double least = a.range().low() - a.error();
  const double error = least > 0 ? a.error() / (2 * std::sqrt(least)) : std::numeric_limits<double>::infinity();
  return {range, square_root(a.middle()), a.by_s() / twice, a.by_t() / twice, error * 1.001 + rounding_of(range)};
}
// One of the two if it is certain; otherwise any value between, with the slopes of either.
inline Enclosure real_max(const Enclosure& a, const Enclosure& b) {
  if (a.low() >= b.high()) return a;
  if (b.low() >= a.high()) return b;
  const auto larger = [](const Interval& x, const Interval& y) {
    return Interval(std::max(x.low(), y.low()), std::max(x.high(), y.high()));
  };
  return {larger(a.range(), b.range()), larger(a.middle(), b.middle()), hull(a.by_s(), b.by_s()),
          hull(a.by_t(), b.by_t()), std::max(a.error(), b.error())};
}
inline Enclosure negated(const Enclosure& a) {
  const auto turn = [](const Interval& x) { return Interval(-x.high(), -x.low()); };
  return {turn(a.range()), turn(a.middle()), turn(a.by_s()), turn(a.by_t()), a.error()};
}
inline Enclosure real_min(const Enclosure& a, const Enclosure& b) { return negated(real_max(negated(a), negated(b))); }
inline Enclosure real_abs(const Enclosure& a) { return real_max(a, negated(a)); }

}  // namespace tessera::frontend
