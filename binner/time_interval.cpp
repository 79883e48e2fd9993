#include "binner/time_interval.h"

#include <cmath>
#include <limits>

namespace tessera::binner {
namespace {

// Distances to one side of the strip: lower bounds over the box at each key, > 0 where all of it is outside.
struct SideDistance {
  double open = std::numeric_limits<double>::infinity(), close = std::numeric_limits<double>::infinity();
};

// Distances to the line at `edge`; outside means sign * (X - edge) > 0.
SideDistance side_distance(const frontend::MovingCorners& corners, std::size_t axis, double edge, double sign) {
  SideDistance d;
  double size = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const DVec4 &p = corners[i], &q = corners[i + 8];
    const int a = static_cast<int>(axis);
    d.open = std::min(d.open, sign * (p[a] - edge * p.w));
    d.close = std::min(d.close, sign * (q[a] - edge * q.w));
    size = std::max({size, std::abs(p[a]), std::abs(q[a]), std::abs(edge) * p.w, std::abs(edge) * q.w});
  }
  // Two roundings of terms no larger than `size`: 2^-52 of it. The distances are moved inwards by far more before the
  // crossing is solved; that, not a nudge of the solution, is what keeps slow motion safe.
  const double slack = size * 0x1p-44;
  d.open -= slack;
  d.close -= slack;
  return d;
}

// Narrows [low, high] to the times at which the distance is not > 0. The comparisons make NaN keep everything.
void keep_touching(const SideDistance& d, double& low, double& high) {
  const bool open_outside = d.open > 0, close_outside = d.close > 0;
  if (open_outside && close_outside) {
    high = -1;  // outside at all times
  } else if (open_outside) {
    low = std::max(low, d.open / (d.open - d.close));
  } else if (close_outside) {
    high = std::min(high, d.open / (d.open - d.close));
  }
}

}  // namespace

TimeInterval times_in_strip(const frontend::MovingCorners& corners, Axis axis, double low, double high, double grow) {
  const std::size_t a = axis == Axis::kX ? 0 : 1;
  double first = 0, last = 1;
  keep_touching(side_distance(corners, a, high + grow, 1), first, last);
  keep_touching(side_distance(corners, a, low - grow, -1), first, last);
  if (first > last) return kNoTime;
  // Rounded outwards, plus one code on each side, which is far beyond the rounding of the division.
  return {std::max(0, static_cast<int>(std::floor(first * 256)) - 1),
          std::min(255, static_cast<int>(std::floor(last * 256)) + 1)};
}

}  // namespace tessera::binner
