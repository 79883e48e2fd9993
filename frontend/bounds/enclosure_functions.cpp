#include "frontend/bounds/enclosure_functions.h"

#include <cstdint>

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::frontend {

// Found by argument-dependent lookup from noise_in_cell: monotone, and highest in the middle.
Interval noise_fade(const Interval& t) {
  const auto at = [](double x) { return x * x * x * (x * (x * 6 - 15) + 10); };
  return Interval::rounded(at(std::clamp(t.low(), 0.0, 1.0)) - 1e-14, at(std::clamp(t.high(), 0.0, 1.0)) + 1e-14);
}
Interval noise_fade_slope(const Interval& t) {
  const auto at = [](double x) { return 30 * (x * (1 - x)) * (x * (1 - x)); };
  const double low = std::clamp(t.low(), 0.0, 1.0), high = std::clamp(t.high(), 0.0, 1.0);
  const double most = low <= 0.5 && high >= 0.5 ? at(0.5) : std::max(at(low), at(high));
  return Interval::rounded(std::min(at(low), at(high)) - 1e-14, most + 1e-14);
}

namespace {

constexpr double kTurn = 6.283185307179586;
constexpr double kSeriesError = 0x1p-21;  // sincos_by_series
constexpr double kNoiseError = 0x1p-17;   // roundings of noise_in_cell: fewer than 100 of numbers below 4
constexpr double kNoiseSlope = 12;  // |slopes| of noise: 1.875 * (largest difference of dot products) + 1, and to spare
constexpr double kMaxLatticeCells = 16;

// Join of two ranges of one function on neighbouring parts.
NoiseRange join(const NoiseRange& a, const NoiseRange& b) {
  return {hull(a.value, b.value), hull(a.by_x, b.by_x), hull(a.by_y, b.by_y)};
}

NoiseRange noise_in_lattice_cell(double column, double row, const Interval& x, const Interval& y) {
  const auto i = static_cast<std::int32_t>(column), j = static_cast<std::int32_t>(row);
  Interval gx[4], gy[4];
  for (int k = 0; k < 4; ++k) {
    const shaders::LatticeGradient g = shaders::lattice_gradient(i + (k & 1), j + (k >> 1));
    gx[k] = static_cast<double>(g.x);
    gy[k] = static_cast<double>(g.y);
  }
  const Interval fx(std::max(x.low() - column, 0.0), std::min(x.high() - column, 1.0)),
      fy(std::max(y.low() - row, 0.0), std::min(y.high() - row, 1.0));
  const shaders::PlaneNoise<Interval> n = shaders::noise_in_cell<Interval>(fx, fy, gx, gy);
  const Interval slope(-kNoiseSlope, kNoiseSlope);
  return {both(n.value, Interval(-1.001, 1.001)), both(n.by_x, slope), both(n.by_y, slope)};
}

// The noise at any point of the parameters' box.
Enclosure composed(const NoiseRange& whole, const Interval& middle, const Enclosure& x, const Enclosure& y,
                   double own_error) {
  const double error = whole.by_x.magnitude() * x.error() + whole.by_y.magnitude() * y.error() + own_error;
  return {whole.value, middle, whole.by_x * x.by_s() + whole.by_y * y.by_s(),
          whole.by_x * x.by_t() + whole.by_y * y.by_t(), error * 1.001};
}

Interval widened(const Interval& a, double by) { return {a.low() - by, a.high() + by}; }

}  // namespace

Interval sine_of_turns(const Interval& turns) {
  const double low = turns.low(), high = turns.high();
  if (!(high - low < 1 && std::abs(low) < 1e6)) return {-1, 1};
  const double a = std::sin((low - std::floor(low)) * kTurn), b = std::sin((high - std::floor(high)) * kTurn);
  constexpr double kSlack = 1e-9;  // an extremum that is nearly inside counts
  const auto inside = [&](double extremum) {
    return std::floor(high - extremum + kSlack) >= std::ceil(low - extremum - kSlack);
  };
  return {inside(0.75) ? -1 : std::max(-1.0, std::min(a, b) - 1e-9),
          inside(0.25) ? 1 : std::min(1.0, std::max(a, b) + 1e-9)};
}

void real_sincos_turns(const Enclosure& turns, Enclosure& sine, Enclosure& cosine) {
  const Interval quarter(0.25), range = widened(turns.range(), turns.error());
  const Interval s = sine_of_turns(range), c = sine_of_turns(range + quarter);
  const auto negative = [](const Interval& a) { return Interval(-a.high(), -a.low()); };
  const Interval slope_s = c * Interval(kTurn), slope_c = negative(s) * Interval(kTurn);
  const double error = turns.error() * kTurn * 1.001 + kSeriesError;
  sine = {s, sine_of_turns(turns.middle()), slope_s * turns.by_s(), slope_s * turns.by_t(), error};
  cosine = {c, sine_of_turns(turns.middle() + quarter), slope_c * turns.by_s(), slope_c * turns.by_t(), error};
}

Enclosure real_floor(const Enclosure& a) {
  const double low = std::floor(a.low()), high = std::floor(a.high());
  if (low == high) return low;
  const auto floors = [](const Interval& x) { return Interval(std::floor(x.low()), std::floor(x.high())); };
  // An error, however small, may lead across a step.
  return {floors(a.range()), floors(a.middle()), Interval::everything(), Interval::everything(), 1.0 + a.error()};
}

Enclosure select_less(const Enclosure& a, const Enclosure& b, const Enclosure& x, const Enclosure& y) {
  if (a.high() < b.low()) return x;
  if (a.low() >= b.high()) return y;
  return {hull(x.range(), y.range()), hull(x.middle(), y.middle()), Interval::everything(), Interval::everything(),
          std::max(x.error(), y.error())};
}

NoiseRange noise_range(const Interval& x, const Interval& y) {
  const double c0 = std::floor(x.low()), c1 = std::floor(x.high()), r0 = std::floor(y.low()), r1 = std::floor(y.high());
  const bool inside = std::abs(c0) < 1e8 && std::abs(c1) < 1e8 && std::abs(r0) < 1e8 && std::abs(r1) < 1e8;
  if (!inside || !((c1 - c0 + 1) * (r1 - r0 + 1) <= kMaxLatticeCells))
    return {Interval(-1.001, 1.001), Interval(-kNoiseSlope, kNoiseSlope), Interval(-kNoiseSlope, kNoiseSlope)};
  NoiseRange out = noise_in_lattice_cell(c0, r0, x, y);
  for (double row = r0; row <= r1; ++row)
    for (double column = c0; column <= c1; ++column) out = join(out, noise_in_lattice_cell(column, row, x, y));
  return out;
}

Enclosure plane_noise(const Enclosure& x, const Enclosure& y) {
  const NoiseRange whole = noise_range(widened(x.range(), x.error()), widened(y.range(), y.error()));
  return composed(whole, noise_range(x.middle(), y.middle()).value, x, y, kNoiseError);
}

Enclosure image_value(const float* values, int width, int height, const Enclosure& u, const Enclosure& v) {
  const double su = width - 1, sv = height - 1;
  const auto texels = [](const Enclosure& a, double size) {
    const auto clamped = [&](double t) { return std::isnan(t) ? 0 : std::clamp(t * size, 0.0, size); };
    const int low = static_cast<int>(std::max(std::floor(clamped(a.low()) - 1e-4), 0.0));
    const int high = static_cast<int>(std::min(std::floor(clamped(a.high()) + 1e-4), size - 1));
    return std::pair(std::min(low, high), high);
  };
  const auto [c0, c1] = texels(u, su);
  const auto [r0, r1] = texels(v, sv);
  const auto at = [&](int column, int row) {
    return static_cast<double>(values[static_cast<std::ptrdiff_t>(row) * width + column]);
  };
  NoiseRange whole{Interval(at(c0, r0)), Interval((at(c0 + 1, r0) - at(c0, r0)) * su),
                   Interval((at(c0, r0 + 1) - at(c0, r0)) * sv)};
  double largest = 0;
  for (int row = r0; row <= r1 + 1; ++row)
    for (int column = c0; column <= c1 + 1; ++column) {
      whole.value = hull(whole.value, Interval(at(column, row)));
      largest = std::max(largest, std::abs(at(column, row)));
      if (column <= c1) whole.by_x = hull(whole.by_x, Interval((at(column + 1, row) - at(column, row)) * su));
      if (row <= r1) whole.by_y = hull(whole.by_y, Interval((at(column, row + 1) - at(column, row)) * sv));
    }
  // Outside [0, 1] the border continues: slopes of zero join those inside.
  whole.by_x = hull(Interval::rounded(whole.by_x.low(), whole.by_x.high()), Interval(0.0));
  whole.by_y = hull(Interval::rounded(whole.by_y.low(), whole.by_y.high()), Interval(0.0));
  const Interval &mu = u.middle(), &mv = v.middle();
  const double x = (mu.low() + mu.high()) / 2, y = (mv.low() + mv.high()) / 2;
  const double reach = whole.by_x.magnitude() * (mu.high() - mu.low()) +
                       whole.by_y.magnitude() * (mv.high() - mv.low()) + 1e-12 * largest;
  const double middle = shaders::image_value(values, width, height, x, y);
  // Positions in texels round by 2^-24 of the image's size, and weights and products a few times more.
  const double own_error = (whole.by_x.magnitude() + whole.by_y.magnitude()) * 0x1p-22 + largest * 0x1p-20;
  return composed(whole, Interval::rounded(middle - reach, middle + reach), u, v, own_error);
}

}  // namespace tessera::frontend
