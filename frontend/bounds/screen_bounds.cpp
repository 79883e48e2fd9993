#include "frontend/bounds/screen_bounds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::frontend {
namespace {

// Rounds to the next float downwards or upwards.
float round_down(double value) {
  const auto f = static_cast<float>(value);
  if (static_cast<double>(f) <= value || std::isnan(f)) return f;
  // The float below, as std::nextafter() finds it.
  const auto bits = std::bit_cast<std::uint32_t>(f);
  return f == 0.0f ? -std::numeric_limits<float>::denorm_min() : std::bit_cast<float>(f > 0.0f ? bits - 1 : bits + 1);
}
float round_up(double value) { return -round_down(-value); }

// Hull of the points that are no nearer than `near`, and of where the ways to the others are cut there.
void cut_hull(std::span<const DVec4> points, const scene::Projection& projection, double near, ScreenHull& hull,
              bool& crosses, bool& any_nan) {
  const auto behind = [&](const DVec4& r) { return !(r.z >= near); };
  for (const DVec4& r : points) {
    any_nan = any_nan || !(((r.x - r.x) + (r.y - r.y)) + ((r.z - r.z) + (r.w - r.w)) == 0);
    if (behind(r))
      crosses = true;
    else
      hull.add(r);
  }
  if (!crosses || any_nan) return;
  for (const DVec4& nearer : points)
    for (const DVec4& farther : points) {
      if (!behind(nearer) || behind(farther)) continue;
      // Cut the way from one to the other where the depth is `near`.
      const double s = (near - nearer.z) / (farther.z - nearer.z);
      DVec4 cut = nearer + (farther - nearer) * s;
      cut.z = near;
      if (!projection.orthographic) cut.w = near;
      hull.add(cut);
    }
}

}  // namespace

double defocus_radius(const scene::Projection& projection, double depth) {
  if (projection.lens_scale == 0) return 0;
  const double coc =
      projection.orthographic ? 1.0 - depth * projection.inverse_focus : 1.0 / depth - projection.inverse_focus;
  return projection.lens_scale * std::abs(coc);
}

std::optional<ScreenBounds> screen_bounds(std::span<const DVec4> points, const scene::Projection& projection,
                                          const RoundingMargin& margin) {
  ScreenHull hull;
  // A point that rounding might lift over the near plane counts as drawn; w stays positive.
  const double near = projection.orthographic ? projection.near - margin.depth
                                              : std::max(projection.near - margin.depth, 0.5 * projection.near);
  bool crosses = false, any_nan = false;
  if (!hull_in_front(points, near, hull)) cut_hull(points, projection, near, hull, crosses, any_nan);
  const double w_error = margin.w / hull.near_w;
  if (any_nan || hull.unusable || w_error > 0.25) {
    constexpr float kFar = std::numeric_limits<float>::max();
    return ScreenBounds{-kFar, -kFar, kFar, kFar, kFar, static_cast<float>(projection.near), kFar, true};
  }
  if (hull.near_z > hull.far_z) return std::nullopt;  // all behind
  if (projection.far > 0 && hull.near_z - margin.depth > projection.far) return std::nullopt;

  const double defocus = std::max(defocus_radius(projection, hull.near_z), defocus_radius(projection, hull.far_z));
  // Relative slack: the arithmetic above is double precision, 2^-40 of the coordinates is generous.
  const double size = std::max({std::abs(hull.x0), std::abs(hull.x1), std::abs(hull.y0), std::abs(hull.y1)});
  // X = xh / w is off by the error of xh over w and by X times the relative error of w. A point more than a frame
  // outside stays outside, so X counts up to two frames.
  const double frame = 4 * std::max(projection.center_x, projection.center_y);
  const double grow =
      defocus * (1 + 0x1p-20) + margin.position / hull.near_w + frame * w_error + margin.pixels + size * 0x1p-40;
  ScreenBounds bounds{};
  bounds.x0 = round_down(hull.x0 - grow);
  bounds.y0 = round_down(hull.y0 - grow);
  bounds.x1 = round_up(hull.x1 + grow);
  bounds.y1 = round_up(hull.y1 + grow);
  bounds.grow = round_up(grow);
  bounds.near_z = round_down(hull.near_z - margin.depth);
  bounds.far_z = round_up(hull.far_z + margin.depth);
  bounds.crosses_near = crosses;
  return bounds;
}

}  // namespace tessera::frontend
