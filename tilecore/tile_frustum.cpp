#include "tilecore/tile_frustum.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {
namespace {

// Keeps of [low, high] the part where a + b * tau <= 0, allowing for an error of `slack` in a and in a + b.
void keep_below(double a, double b, double slack, double& low, double& high) {
  const double open = a - slack, close = a + b - slack;  // at tau = 0 and 1
  if (!(open > 0) && !(close > 0)) return;
  if (open > 0 && close > 0) {
    high = -1;  // outside at both ends: never inside
    return;
  }
  const double crossing = open / (open - close);
  if (open > 0) low = std::max(low, crossing);
  else high = std::min(high, crossing);
}

}  // namespace

TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_radius) {
  const double reach = static_cast<double>(lens_radius) * static_cast<double>(std::max(std::abs(leaf.coc_low), std::abs(leaf.coc_high)));
  double low = 0, high = 1;
  const auto axis = [&](float face_low, float d_low, float face_high, float d_high, int begin, int end) {
    // Samples lie in [begin, end). 2^-20 of the coordinates is 16 roundings of single precision.
    const double size = std::abs(static_cast<double>(face_low)) + std::abs(static_cast<double>(face_high)) +
                        std::abs(static_cast<double>(d_low)) + std::abs(static_cast<double>(d_high)) + std::abs(static_cast<double>(end)) + reach;
    const double slack = reach + size * 0x1p-20;
    keep_below(static_cast<double>(face_low) - end, static_cast<double>(d_low), slack, low, high);
    keep_below(begin - static_cast<double>(face_high), -static_cast<double>(d_high), slack, low, high);
  };
  if (!(leaf.x_low <= leaf.x_high)) return {1, 0};
  axis(leaf.x_low, leaf.x_d_low, leaf.x_high, leaf.x_d_high, pixels.x0, pixels.x1);
  axis(leaf.y_low, leaf.y_d_low, leaf.y_high, leaf.y_d_high, pixels.y0, pixels.y1);
  if (low > high) return {1, 0};
  if (!moving) return {0, 255};
  // tau = t r / ((1-t) + t r), so t = tau / (tau + r (1 - tau)).
  const double rate = static_cast<double>(leaf.rate);
  const auto time = [&](double tau) { return tau / (tau + rate * (1 - tau)); };
  TimeRange range;
  range.first = std::max(0, static_cast<int>(std::floor(time(low) * 256)) - 1);
  range.last = std::min(255, static_cast<int>(std::ceil(time(high) * 256)) + 1);
  return range;
}

}  // namespace tessera::tilecore
