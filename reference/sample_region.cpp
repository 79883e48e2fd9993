#include "reference/sample_region.h"

#include <algorithm>
#include <cmath>

namespace tessera::reference {
namespace {

constexpr double kPixelMargin = 0x1p-20;  // places of samples are rounded
constexpr double kRounding = 0x1p-46;     // fraction of a sum's largest term; far more than the sums here lose

}  // namespace

SampleRegion::SampleRegion(const scene::Projection& projection, const IntRect& pixels)
    : pixels_(pixels),
      left_(pixels.x0 - projection.center_x - kPixelMargin),
      right_(pixels.x1 - projection.center_x + kPixelMargin),
      top_(pixels.y0 - projection.center_y - kPixelMargin),
      bottom_(pixels.y1 - projection.center_y + kPixelMargin),
      near_(projection.near),
      far_(projection.far > 0 ? projection.far : std::numeric_limits<double>::infinity()),
      lens_scale_(projection.lens_scale * (1 + kPixelMargin)),
      inverse_focus_(projection.inverse_focus),
      orthographic_(projection.orthographic) {}

SampleRegion SampleRegion::everything(const scene::Projection& projection, const IntRect& pixels) {
  SampleRegion region(projection, pixels);
  region.everything_ = true;
  return region;
}

SampleRegion::Axes SampleRegion::axes(const DMat4& to_space) const {
  const auto row = [&](int r) { return DVec4(to_space[0][r], to_space[1][r], to_space[2][r], to_space[3][r]); };
  const DVec4 x = row(0), y = row(1), depth = row(2), w = orthographic_ ? DVec4(0, 0, 0, 1) : depth;
  return {depth, x - left_ * w, right_ * w - x, y - top_ * w, bottom_ * w - y};
}

void SampleRegion::add(Extent& extent, const double* point) const {
  const double x = point[0], y = point[1], depth = point[2], w = orthographic_ ? 1.0 : depth;
  const auto add = [&](std::size_t axis, double a, double b) {
    const double slack = (std::abs(a) + std::abs(b)) * kRounding;
    extent.add(axis, a + b - slack, a + b + slack);
  };
  add(0, depth, 0);
  add(1, x, -left_ * w);
  add(2, right_ * w, -x);
  add(3, y, -top_ * w);
  add(4, bottom_ * w, -y);
}

bool SampleRegion::misses(const Extent& extent) const {
  if (everything_) return false;
  const double z0 = std::max(extent.low[0], near_ * (1 - kPixelMargin)),
               z1 = std::min(extent.high[0], far_ * (1 + kPixelMargin));
  if (z0 > z1) return true;
  if (lens_scale_ == 0) return std::any_of(&extent.high[1], &extent.high[0] + kAxes, [](double d) { return d < 0; });
  // The spread is convex in z, so its maximum is at one of the ends.
  const double spread = lens_scale_ * std::max(std::abs(1 - z0 * inverse_focus_), std::abs(1 - z1 * inverse_focus_)),
               margin = lens_scale_ * (1 + std::max(std::abs(z0), std::abs(z1)) * inverse_focus_) * kPixelMargin;
  return std::any_of(&extent.high[1], &extent.high[0] + kAxes, [&](double d) { return d < -spread - margin; });
}

bool SampleRegion::holds(const Extent& extent) const {
  if (everything_) return true;
  return std::all_of(&extent.low[1], &extent.low[0] + kAxes, [](double d) { return d > 0; }) && extent.low[0] > near_ &&
         extent.high[0] < far_;
}

}  // namespace tessera::reference
