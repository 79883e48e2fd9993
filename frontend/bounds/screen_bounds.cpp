#include "frontend/bounds/screen_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::frontend {
namespace {

// Box of projected points that grows point by point.
struct Hull {
  static constexpr double kEmpty = std::numeric_limits<double>::infinity();
  double x0 = kEmpty, y0 = kEmpty, x1 = -kEmpty, y1 = -kEmpty;
  double near_z = kEmpty, far_z = -kEmpty, near_w = kEmpty;
  bool unusable = false;  // a coordinate was NaN or infinite

  void add(const DVec4& r) {
    const double inverse = 1 / r.w, x = r.x * inverse, y = r.y * inverse;
    // Zero unless something is NaN or infinite.
    if (!((x - x) + (y - y) + (r.z - r.z) == 0)) unusable = true;
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
    near_z = std::min(near_z, r.z);
    far_z = std::max(far_z, r.z);
    near_w = std::min(near_w, r.w);
  }
};

// To the next float downwards or upwards.
float round_down(double value) {
  const auto f = static_cast<float>(value);
  return static_cast<double>(f) <= value ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float round_up(double value) { return -round_down(-value); }

}  // namespace

double defocus_radius(const scene::Projection& projection, double depth) {
  if (projection.lens_scale == 0) return 0;
  const double coc =
      projection.orthographic ? 1.0 - depth * projection.inverse_focus : 1.0 / depth - projection.inverse_focus;
  return projection.lens_scale * std::abs(coc);
}

std::optional<ScreenBounds> screen_bounds(std::span<const DVec4> points, const scene::Projection& projection,
                                          const RoundingMargin& margin) {
  Hull hull;
  // What rounding might lift over the near plane counts as drawn; w stays positive.
  const double near = projection.orthographic ? projection.near - margin.depth
                                              : std::max(projection.near - margin.depth, 0.5 * projection.near);
  const auto behind = [&](const DVec4& r) { return !(r.z >= near); };
  bool crosses = false, any_nan = false;
  for (const DVec4& r : points) {
    any_nan = any_nan || !(((r.x - r.x) + (r.y - r.y)) + ((r.z - r.z) + (r.w - r.w)) == 0);
    if (behind(r))
      crosses = true;
    else
      hull.add(r);
  }
  if (crosses && !any_nan)
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
  // X = xh / w is off by the error of xh over w and by X times the relative error of w; what lies more than a frame
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
