#pragma once

#include <array>
#include <cstddef>

#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {

// The two-parameter family of Mitchell and Netravali 1988; support [-2, 2].
constexpr double mitchell_netravali(double x, double b, double c) {
  const double a = x < 0 ? -x : x;
  if (a < 1) return ((12 - 9 * b - 6 * c) * a * a * a + (-18 + 12 * b + 6 * c) * a * a + (6 - 2 * b)) / 6;
  if (a < 2)
    return ((-b - 6 * c) * a * a * a + (6 * b + 30 * c) * a * a + (-12 * b - 48 * c) * a + (8 * b + 24 * c)) / 6;
  return 0;
}

// Farthest pixel along an axis that may have a weight. kNearest has no weights.
constexpr int kernel_reach(Reconstruction r) {
  switch (r) {
    case Reconstruction::kNearest:
      return 0;
    case Reconstruction::kBilinear:
      return 1;
    case Reconstruction::kCubicUnscaled:
    case Reconstruction::kCubic:
      return 2;
    case Reconstruction::kCubicInterpolating:
      return 3;
  }
  return 0;
}

// k at a distance of whole pixels; 0 beyond the reach.
constexpr double kernel_weight(Reconstruction r, int distance) {
  const int d = distance < 0 ? -distance : distance;
  if (d > kernel_reach(r)) return 0;
  switch (r) {
    case Reconstruction::kNearest:
      return 0;
    case Reconstruction::kBilinear:
      return 1 - d * 0.5;
    // Exactly 0 at 2, which the polynomial meets only up to rounding.
    case Reconstruction::kCubicUnscaled:
      return d == 2 ? 0 : mitchell_netravali(d, 1.0 / 3, 1.0 / 3);
    case Reconstruction::kCubic:
      return mitchell_netravali(d * (2.0 / 3), 1.0 / 3, 1.0 / 3);
    case Reconstruction::kCubicInterpolating:
      return mitchell_netravali(d * 0.5, 0, 0.5);
  }
  return 0;
}

inline constexpr std::size_t kMaxDirectTaps = 49;  // of 7x7

// A stencil holds if the sum of its weights is at least this share of the sum of their magnitudes. Then no normalised
// weight exceeds 2, and noise in the taps grows by less than 2.
inline constexpr double kMinimumDenominator = 0.5;

}  // namespace tessera::tilecore
