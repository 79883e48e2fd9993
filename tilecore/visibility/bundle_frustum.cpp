#include "tilecore/visibility/bundle_frustum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::tilecore {
namespace {

constexpr float kFar = 3e38f;      // of empty boxes; finite, so that no product with it is NaN
constexpr float kUnit = 0x1p-24f;  // u of single precision

// A time that is not negative, `n` steps of single precision earlier (0 at the earliest) or later.
float ulps_down(float t, std::int32_t n) {
  return std::bit_cast<float>(std::max(std::bit_cast<std::int32_t>(t) - n, 0));
}
float ulps_up(float t, std::int32_t n) {
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(t + 0.0f) + n);  // the sum has no negative zero
}

}  // namespace

MotionBox MotionBox::empty() {
  MotionBox box;
  for (std::size_t key = 0; key < 2; ++key) {
    box.low[key].fill(kFar);
    box.high[key].fill(-kFar);
  }
  return box;
}

void MotionBox::merge(const MotionBox& o) {
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[key][axis] = std::min(low[key][axis], o.low[key][axis]);
      high[key][axis] = std::max(high[key][axis], o.high[key][axis]);
    }
}

BundleFrustum::BundleFrustum(const RaySpace& space, const IntRect& pixels, float near, float far)
    : extremes_(space.lens_radius > 0 ? 2 : 1) {
  const std::array<double, 4> at = {pixels.x0 - space.center_x, pixels.x1 - space.center_x, pixels.y0 - space.center_y,
                                    pixels.y1 - space.center_y};
  // Lens points are computed in single precision: a little may stick out of the disc.
  const double radius = space.lens_radius * (1 + 0x1p-20);
  for (std::size_t side = 0; side < 4; ++side)
    for (std::size_t extreme = 0; extreme < 2; ++extreme) {
      const double lens = extreme == 0 ? radius : -radius, outwards = side % 2 == 0 ? -1.0 : 1.0;
      // The side's line is offset + slope z.
      const double offset = space.orthographic ? at[side] + lens : lens;
      const double slope = space.orthographic ? -lens * space.inverse_focus : at[side] - lens * space.inverse_focus;
      sides_[side][extreme] = {side / 2, static_cast<float>(outwards), static_cast<float>(-outwards * slope),
                               static_cast<float>(-outwards * offset)};
    }
  depth_[0] = {2, -1.0f, 0.0f, near};
  depth_[1] = {2, 1.0f, 0.0f, -far};
  depth_count_ = far < std::numeric_limits<float>::infinity() ? 2 : 1;
}

void BundleFrustum::drop_depth_planes(const MotionBox& root) {
  if (depth_count_ == 2 && root.high[0][2] <= -depth_[1].offset && root.high[1][2] <= -depth_[1].offset)
    depth_count_ = 1;
  if (root.low[0][2] >= depth_[0].offset && root.low[1][2] >= depth_[0].offset) first_depth_ = 1;
}

BundleFrustum::Distances BundleFrustum::distances(const Plane& plane, const MotionBox& box) {
  const auto at = [&](std::size_t key) {
    const float p = plane.sign > 0 ? box.low[key][plane.axis] : box.high[key][plane.axis];
    const float z = plane.slope > 0 ? box.low[key][2] : box.high[key][2];
    const float slant = plane.slope * z, distance = (plane.sign * p + slant) + plane.offset;
    return distance - 6 * kUnit * ((std::abs(p) + std::abs(slant)) + std::abs(plane.offset));
  };
  return {at(0), at(1)};
}

BundleFrustum::Times BundleFrustum::inside_times(const Distances& d) {
  if (d.outside()) return {1, 0};
  if (d.open > 0) return {std::max(0.0f, ulps_down(d.open / (d.open - d.close), 3)), 1};
  if (d.close > 0) return {0, std::min(1.0f, ulps_up(d.open / (d.open - d.close), 3))};
  return {};
}

bool BundleFrustum::outside(const MotionBox& box) const {
  if (box.is_empty()) return true;
  for (const auto& side : sides_) {
    bool all = true;
    for (std::size_t k = 0; k < extremes_; ++k) all = all && distances(side[k], box).outside();
    if (all) return true;
  }
  for (std::size_t k = first_depth_; k < depth_count_; ++k)
    if (distances(depth_[k], box).outside()) return true;
  return false;
}

BundleFrustum::Times BundleFrustum::times(const MotionBox& box) const {
  if (box.is_empty()) return {1, 0};
  Times all;
  const auto keep = [&](const Times& inside) {
    all = {std::max(all.low, inside.low), std::min(all.high, inside.high)};
  };
  for (const auto& side : sides_) {
    Times hull{2, -1};
    for (std::size_t k = 0; k < extremes_; ++k) {
      const Times one = inside_times(distances(side[k], box));
      if (!one.empty()) hull = {std::min(hull.low, one.low), std::max(hull.high, one.high)};
    }
    keep(hull);
    if (all.empty()) return all;
  }
  for (std::size_t k = first_depth_; k < depth_count_; ++k) keep(inside_times(distances(depth_[k], box)));
  return all;
}

}  // namespace tessera::tilecore
