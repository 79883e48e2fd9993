#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/rect.h"
#include "scene/view.h"

namespace tessera::tilecore {

// Share of its size by which a footprint is wider than its parallelogram, besides its slack. Neighbouring footprints
// overlap by it; the tie rule decides there.
inline constexpr float kSlackShare = 1.0f / 256;

// The footprint of a sample on screen: middle, half steps along both parameters, in pixels; det = a x b. `slack`:
// pixels by which the footprint is wider to each side, to allow for the curvature of the surface within half a step.
struct Parallelogram {
  float x, y, ax, ay, bx, by, det, slack;

  // The position of a point in half steps; false if it is outside.
  bool holds(float px, float py, float& along_u, float& along_v) const {
    const float dx = px - x, dy = py - y;
    const float nu = dx * by - dy * bx, nv = ax * dy - ay * dx, size = std::abs(det) * (1.0f + kSlackShare);
    // Distances to the sides times the sides' lengths.
    if (!(std::abs(nu) <= size + slack * (std::abs(bx) + std::abs(by))) ||
        !(std::abs(nv) <= size + slack * (std::abs(ax) + std::abs(ay))))
      return false;
    // Edge-on there is no inside: points near the middle count.
    const bool flat = std::abs(det) < 1e-12f;
    along_u = flat ? 0.0f : std::clamp(nu / det, -1.0f, 1.0f);
    along_v = flat ? 0.0f : std::clamp(nv / det, -1.0f, 1.0f);
    return std::abs(dx) <= std::abs(ax) + std::abs(bx) + slack && std::abs(dy) <= std::abs(ay) + std::abs(by) + slack;
  }
};

// The footprint of a sample of a surface that moves or is out of focus: a parallelogram for each time of the shutter
// and each point of the lens. Linear in time before the division by depth.
class MovingFootprint {
 public:
  // Middle and half steps along both parameters at one key; homogeneous raster space: in perspective z is the divisor.
  struct Key {
    float x, y, z, xu, yu, zu, xv, yv, zv;
    bool finite() const { return std::isfinite(x + y + z + xu + yu + zu + xv + yv + zv); }
  };
  // Depth of the middle, and its change for half a step along each parameter.
  struct Depth {
    float z, z_u, z_v;
  };
  // Pixels.
  struct Box {
    float x0, y0, x1, y1;
    bool empty() const { return !(x0 <= x1 && y0 <= y1); }
    bool holds(float x, float y) const { return !(x < x0 || x > x1 || y < y0 || y > y1); }
    // Returns the pixels of `within` that it touches.
    IntRect pixels(const IntRect& within) const;
  };

  // `lens_scale`: largest |(u, v)| of a sample, 0 for a pinhole. `slack` as in Parallelogram.
  MovingFootprint(const Key& open, const Key& close, const scene::Projection& projection, float lens_scale, float slack)
      : open_(open),
        close_(close),
        near_(static_cast<float>(projection.near)),
        far_(projection.far > 0 ? static_cast<float>(projection.far) : std::numeric_limits<float>::infinity()),
        inverse_focus_(static_cast<float>(projection.inverse_focus)),
        lens_scale_(lens_scale),
        slack_(slack),
        orthographic_(projection.orthographic) {}

  bool finite() const { return open_.finite() && close_.finite(); }
  // Whether it is nearer than the near plane, or farther than the far one, at both motion keys and so all the time.
  bool out_of_depth() const { return (open_.z < near_ && close_.z < near_) || (open_.z > far_ && close_.z > far_); }

  // The footprint at time t of [0, 1], through a point of the lens; false if its middle is outside of the depth range.
  bool at(float t, float lens_u, float lens_v, Parallelogram& p, Depth& depth) const {
    const auto mix = [&](float a, float b) { return a * (1.0f - t) + b * t; };
    const float z = mix(open_.z, close_.z);
    if (!(z >= near_ && z <= far_)) return false;
    depth = {z, mix(open_.zu, close_.zu), mix(open_.zv, close_.zv)};
    const float inverse = orthographic_ ? 1.0f : 1.0f / z, turn = orthographic_ ? 0.0f : 1.0f;
    p.x = mix(open_.x, close_.x) * inverse, p.y = mix(open_.y, close_.y) * inverse;
    p.ax = (mix(open_.xu, close_.xu) - turn * p.x * depth.z_u) * inverse,
    p.ay = (mix(open_.yu, close_.yu) - turn * p.y * depth.z_u) * inverse;
    p.bx = (mix(open_.xv, close_.xv) - turn * p.x * depth.z_v) * inverse,
    p.by = (mix(open_.yv, close_.yv) - turn * p.y * depth.z_v) * inverse;
    if (lens_scale_ > 0) {
      const float coc = circle_of_confusion(z), slope = orthographic_ ? -inverse_focus_ : -inverse * inverse;
      p.x += lens_u * coc, p.y += lens_v * coc;
      p.ax += lens_u * slope * depth.z_u, p.ay += lens_v * slope * depth.z_u;
      p.bx += lens_u * slope * depth.z_v, p.by += lens_v * slope * depth.z_v;
    }
    p.det = p.ax * p.by - p.ay * p.bx;
    p.slack = slack_;
    return true;
  }

  // Box over the visible part of the shutter and the whole lens: its positions at the two ends hold all between.
  // Returns false, and leaves `box` alone, if the near plane cuts the footprint.
  bool bounds(Box& box) const;

 private:
  // Circle of confusion in pixels for the lens point (1, 0); negative behind the plane in focus.
  float circle_of_confusion(float z) const {
    return orthographic_ ? 1.0f - z * inverse_focus_ : 1.0f / z - inverse_focus_;
  }

  Key open_, close_;
  float near_, far_, inverse_focus_, lens_scale_, slack_;
  bool orthographic_;
};

}  // namespace tessera::tilecore
