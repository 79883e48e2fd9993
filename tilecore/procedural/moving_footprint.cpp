#include "tilecore/procedural/moving_footprint.h"

namespace tessera::tilecore {

bool MovingFootprint::bounds(Box& box) const {
  // Rounded towards the middle of the shutter, so that the ends lie behind the near plane.
  float t0 = 0, t1 = 1;
  if (open_.z < near_) t0 = std::min((near_ - open_.z) / (close_.z - open_.z) * 1.0001f, 1.0f);
  if (close_.z < near_) t1 = std::max((open_.z - near_) / (open_.z - close_.z) * 0.9999f, 0.0f);
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Box all{kFar, kFar, -kFar, -kFar};
  for (const float t : {t0, t1}) {
    Parallelogram p;
    Depth depth;
    if (!at(t, 0, 0, p, depth)) return false;
    // Through the lens the middle moves by the circle of confusion, and half a step by what that changes along it.
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
