#include "tilecore/visibility/tile_frustum.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {
namespace {

// Interval of a leaf's own time tau; empty when low > high.
struct LeafInterval {
  double low = 0, high = 1;

  // Keeps the part where a + b * tau <= 0, allowing for an error of `slack` in a and in a + b.
  void keep_below(double a, double b, double slack) {
    const double open = a - slack, close = a + b - slack;  // at tau = 0 and 1
    if (!(open > 0) && !(close > 0)) return;
    if (open > 0 && close > 0) {
      high = -1;  // outside at both ends: never inside
      return;
    }
    const double crossing = open / (open - close);
    if (open > 0)
      low = std::max(low, crossing);
    else
      high = std::min(high, crossing);
  }

  // Columns or rows of pixels [begin, end) against faces that drift.
  void keep_touching(float face_low, float face_high, float drift, int begin, int end, double reach) {
    // 2^-20 of the coordinates is 16 roundings of single precision.
    const double size = std::abs(static_cast<double>(face_low)) + std::abs(static_cast<double>(face_high)) +
                        2 * std::abs(static_cast<double>(drift)) + std::abs(static_cast<double>(end)) + reach;
    const double slack = reach + size * 0x1p-20;
    keep_below(static_cast<double>(face_low) - end, static_cast<double>(drift), slack);
    keep_below(begin - static_cast<double>(face_high), -static_cast<double>(drift), slack);
  }
};

}  // namespace

TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_scale) {
  constexpr TimeRange kNever{1, 0};
  if (!(leaf.x_low <= leaf.x_high)) return kNever;
  const double reach = static_cast<double>(lens_scale) * std::abs(static_cast<double>(leaf.lens_factor));
  LeafInterval interval;
  interval.keep_touching(leaf.x_low, leaf.x_high, leaf.drift_x, pixels.x0, pixels.x1, reach);
  interval.keep_touching(leaf.y_low, leaf.y_high, leaf.drift_y, pixels.y0, pixels.y1, reach);
  if (interval.low > interval.high) return kNever;
  if (!moving) return {0, 255};
  // tau = t r / ((1-t) + t r), so t = tau / (tau + r (1 - tau)).
  const double rate = static_cast<double>(leaf.rate);
  const auto time = [&](double tau) { return tau / (tau + rate * (1 - tau)); };
  return {std::max(0, static_cast<int>(std::floor(time(interval.low) * 256)) - 1),
          std::min(255, static_cast<int>(std::ceil(time(interval.high) * 256)) + 1)};
}

}  // namespace tessera::tilecore
