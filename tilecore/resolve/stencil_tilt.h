#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace tessera::tilecore {

struct ExactTap {
  int dx, dy;
  double weight;
};

// Mean squared distance of a border stencil's taps along the border: as large as for interior missing pixels from
// their taps, both axes together, so that borders have the same error as the interior.
inline constexpr double kBorderSpread = 0.25;  // [measured] by noise of 2 to 8 pixels, checkers and sinusoids
// A condition that differs from the earlier ones by less than this share counts as dependent on them.
inline constexpr double kDependent = 1e-3;

// Weights w become w + |w| (a g(dx, dy) + b h(dx, dy) + ...) such that the sums over taps of w g, w h, ... are 0: the least
// change in the sense of squares over magnitudes.
struct StencilConditions {
  static constexpr std::size_t kMost = 3;
  std::size_t count = 2;  // the mean of the taps is the pixel, along x and along y
  bool along_x = false;   // direction of the third condition, if any: the spread along x, else along y

  double value(std::size_t condition, const ExactTap& t) const {
    if (condition < 2) return condition == 0 ? t.dx : t.dy;
    return (along_x ? t.dx * t.dx : t.dy * t.dy) - kBorderSpread;
  }

  void impose(std::span<ExactTap> taps) const {
    std::array<std::array<double, kMost + 1>, kMost> m{};  // influence of each condition on each; the needed change
    std::array<double, kMost> diagonal{}, factor{};
    for (const ExactTap& t : taps)
      for (std::size_t r = 0; r < count; ++r) {
        const double g = value(r, t);
        for (std::size_t c = 0; c < count; ++c) m[r][c] += (t.weight < 0 ? -t.weight : t.weight) * g * value(c, t);
        m[r][kMost] -= t.weight * g;
      }
    for (std::size_t r = 0; r < count; ++r) diagonal[r] = m[r][r];
    std::array<bool, kMost> holds{};
    for (std::size_t p = 0; p < count; ++p) {
      holds[p] = m[p][p] > kDependent * diagonal[p];
      for (std::size_t r = p + 1; r < count && holds[p]; ++r) {
        const double share = m[r][p] / m[p][p];
        for (std::size_t c = 0; c <= kMost; ++c) m[r][c] -= share * m[p][c];
      }
    }
    for (std::size_t p = count; p-- > 0;) {
      if (!holds[p]) continue;
      factor[p] = m[p][kMost];
      for (std::size_t c = p + 1; c < count; ++c) factor[p] -= m[p][c] * factor[c];
      factor[p] /= m[p][p];
    }
    for (ExactTap& t : taps) {
      double change = 0;
      for (std::size_t r = 0; r < count; ++r) change += factor[r] * value(r, t);
      t.weight += (t.weight < 0 ? -t.weight : t.weight) * change;
    }
  }
};

// Makes a stencil whose taps lie more on one side than on the other, at a tile's border or at a silhouette, reproduce
// ramps of the colour, as kernel regression of first order does (Fan 1992). (Deviations: magnitudes, so that negative
// lobes do not cancel it; on a straight border the spread along it.) Weights sum to one afterwards. Stencils that are
// symmetric along an axis do not change along it.
//
// Tilted weights hold if their sum is neither a difference of large terms nor tiny beside the plain one's: taps on one
// side only cannot give a ramp's value on the other. Otherwise the plain weights stay. At most N taps.
template <std::size_t N>
void tilt(std::span<ExactTap> taps) {
  double plain = 0;
  bool left = false, right = false, above = false, below = false;
  for (const ExactTap& t : taps) {
    plain += t.weight;
    left = left || t.dx < 0, right = right || t.dx > 0, above = above || t.dy < 0, below = below || t.dy > 0;
  }
  const bool border_x = left != right, border_y = above != below;
  std::array<ExactTap, N> tilted;
  const auto tries = [&](const StencilConditions& conditions) {
    std::copy(taps.begin(), taps.end(), tilted.begin());
    const std::span<ExactTap> out(tilted.data(), taps.size());
    conditions.impose(out);
    double sum = 0, magnitude = 0;
    for (const ExactTap& t : out) sum += t.weight, magnitude += t.weight < 0 ? -t.weight : t.weight;
    if (!(sum >= 0.5 * magnitude && sum > 0.1 * plain)) return false;
    for (std::size_t i = 0; i < taps.size(); ++i) taps[i].weight = out[i].weight / sum;
    return true;
  };
  if (border_x != border_y && tries({3, border_y})) return;
  if (tries({})) return;
  for (ExactTap& t : taps) t.weight /= plain;
}

}  // namespace tessera::tilecore
