#include "tilecore/procedural/footprint.h"

namespace tessera::tilecore {

IntRect MovingFootprint::Box::pixels(const IntRect& within) const {
  const auto pixel = [](float a, int low, int high) {
    return static_cast<int>(std::floor(std::min(std::max(a, static_cast<float>(low)), static_cast<float>(high))));
  };
  return {pixel(x0, within.x0, within.x1), pixel(y0, within.y0, within.y1),
          std::min(pixel(x1, within.x0 - 1, within.x1) + 1, within.x1),
          std::min(pixel(y1, within.y0 - 1, within.y1) + 1, within.y1)};
}

bool MovingFootprint::bounds(Box& box) const {
  // Rounded towards the middle of the shutter, so that the ends are not nearer than the near plane.
  float t0 = 0, t1 = 1;
  if (open_.z < near_) t0 = std::min((near_ - open_.z) / (close_.z - open_.z) * 1.0001f, 1.0f);
  if (close_.z < near_) t1 = std::max((open_.z - near_) / (open_.z - close_.z) * 0.9999f, 0.0f);
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Box all{kFar, kFar, -kFar, -kFar};
  for (const float t : {t0, t1}) {
    Parallelogram p;
    Depth depth;
    if (!at(t, 0, 0, p, depth)) return false;
    // The lens moves the middle by the circle of confusion, and half a step by the change of the circle along it.
    const float slope = orthographic_ ? std::abs(inverse_focus_) : 1.0f / (depth.z * depth.z);
    const float coc = lens_scale_ > 0 ? lens_scale_ * std::abs(circle_of_confusion(depth.z)) : 0.0f;
    const float spread = lens_scale_ > 0 ? lens_scale_ * (std::abs(depth.z_u) + std::abs(depth.z_v)) * slope : 0.0f;
    const float rx = std::abs(p.ax) + std::abs(p.bx) + coc + spread + 2 * p.slack,
                ry = std::abs(p.ay) + std::abs(p.by) + coc + spread + 2 * p.slack;
    all = {std::min(all.x0, p.x - rx), std::min(all.y0, p.y - ry), std::max(all.x1, p.x + rx),
           std::max(all.y1, p.y + ry)};
  }
  box = all;
  return true;
}

}  // namespace tessera::tilecore
