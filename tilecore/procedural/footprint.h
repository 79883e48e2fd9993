#pragma once

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {

// Share of its size by which a footprint is wider than its parallelogram, besides its slack. Neighbouring footprints
// overlap by it; the tie rule decides there.
inline constexpr float kSlackShare = 1.0f / 256;

// The footprint of a sample on screen: middle, half steps along both parameters, in pixels; det = a x b. `slack`:
// pixels by which the footprint is wider to each side, for what the surface bends within half a step.
struct Parallelogram {
  float x, y, ax, ay, bx, by, det, slack;

  // Where a point lies in half steps, or nothing when it is outside.
  bool holds(float px, float py, float& along_u, float& along_v) const {
    const float dx = px - x, dy = py - y;
    const float nu = dx * by - dy * bx, nv = ax * dy - ay * dx, size = std::abs(det) * (1.0f + kSlackShare);
    // Distances to the sides times the sides' lengths.
    if (!(std::abs(nu) <= size + slack * (std::abs(bx) + std::abs(by))) ||
        !(std::abs(nv) <= size + slack * (std::abs(ax) + std::abs(ay))))
      return false;
    // Edge-on there is no inside: what is near the middle counts.
    const bool flat = std::abs(det) < 1e-12f;
    along_u = flat ? 0.0f : std::clamp(nu / det, -1.0f, 1.0f);
    along_v = flat ? 0.0f : std::clamp(nv / det, -1.0f, 1.0f);
    return std::abs(dx) <= std::abs(ax) + std::abs(bx) + slack && std::abs(dy) <= std::abs(ay) + std::abs(by) + slack;
  }
};

}  // namespace tessera::tilecore
