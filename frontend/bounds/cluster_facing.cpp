#include "frontend/bounds/cluster_facing.h"

#include <algorithm>
#include <cmath>

#include "scene/subpixel.h"

namespace tessera::frontend {
namespace {

// The linear part of the transformation from object space to camera space, by columns, recovered from the machine's
// matrix to raster space.
DMat3 to_camera(const Mat4& to_raster, const scene::Projection& p) {
  DMat3 linear;
  for (int column = 0; column < 3; ++column) {
    const DVec4 r(to_raster[column]);
    const double in_plane = p.orthographic ? 0 : r.z;
    linear[column] = DVec3(r.x - p.center_x * in_plane, p.center_y * in_plane - r.y, -p.scale * r.z) / p.scale;
  }
  return linear;
}

// The matrix that takes the cross product of two vectors to the cross product of their images under `m`.
DMat3 cofactors(const DMat3& m) { return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])}; }

// At least the factor by which a matrix lengthens any vector.
double largest_factor(const DMat3& m) {
  const DMat3 square = glm::transpose(m) * m;
  double largest = 0;
  for (int r = 0; r < 3; ++r)
    largest = std::max(largest, std::abs(square[0][r]) + std::abs(square[1][r]) + std::abs(square[2][r]));
  return std::sqrt(largest);
}

// Least product of a vector with the cone's unit vectors.
double least_product(const DVec3& v, const DVec3& axis, double cosine, double sine) {
  const double along = glm::dot(v, axis);
  return along * cosine - sine * std::sqrt(std::max(0.0, glm::dot(v, v) - along * along));
}

// How far floats may put a vertex beside its place in camera space: a margin is 72 roundings of the largest sum of terms,
// of which the transformation of a vertex takes fewer than six.
double vertex_error(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, const MovingBox& box) {
  const scene::Projection& p = frame.projection;
  const RoundingMargin margin =
      vertex_rounding_margin(box, 0, drawable.to_raster, static_cast<double>(frame.request.subpixels()));
  const double center = p.orthographic ? 0 : std::max(std::abs(p.center_x), std::abs(p.center_y));
  const double in_plane = (margin.position + center * margin.depth) / p.scale;
  return (2 * in_plane + margin.depth) / 12;
}

MovingBox still_box(const std::array<DVec3, 3>& axes, const std::array<float, 3>& low,
                    const std::array<float, 3>& high) {
  MovingBox box = empty_box(axes);
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[key][axis] = static_cast<double>(low[axis]);
      box.high[key][axis] = static_cast<double>(high[axis]);
    }
  return box;
}

}  // namespace

MovingBox resting_box(const scene::ClusterBound& bound) { return still_box(bound.frame(), bound.low, bound.high); }
MovingBox aligned_box(const scene::ClusterBound& bound) {
  return still_box(scene::ClusterBound{}.frame(), bound.aligned_low, bound.aligned_high);
}

bool cluster_faces_away(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                        const scene::ClusterBound& bound, const MovingCorners& corners) {
  if (!(bound.cone_cosine > 0)) return false;
  const scene::Projection& p = frame.projection;
  const std::size_t keys = drawable.moving ? 2 : 1;
  std::array<DMat3, 2> linear;
  double stretch = 0;
  for (std::size_t key = 0; key < keys; ++key) {
    linear[key] = to_camera(drawable.to_raster[key], p);
    stretch = std::max(stretch, largest_factor(linear[key]));
  }
  std::array<DMat3, 3> turns;
  turns[0] = cofactors(linear[0]);
  if (keys == 2) {
    turns[1] = cofactors(linear[1]);
    turns[2] = (cofactors(linear[0] + linear[1]) - turns[0] - turns[1]) * 0.5;
  }

  std::array<DVec3, 16> at;
  double near_w = 1e300, far_w = 0, longest = 0;
  for (std::size_t k = 0; k < 8 * keys; ++k) {
    const DVec4& r = corners[k];
    if (!(r.z >= p.near)) return false;
    at[k] = p.orthographic ? DVec3(0, 0, -1)
                           : DVec3((r.x - p.center_x * r.z) / p.scale, (p.center_y * r.z - r.y) / p.scale, -r.z);
    near_w = std::min(near_w, r.w), far_w = std::max(far_w, r.w);
    longest = std::max(longest, glm::length(at[k]));
  }

  // Least product of a vertex's place, seen from any point of the lens, with the normal of a triangle of unit size.
  const double turned = drawable.mirrored ? -1 : 1;
  const double aperture = p.lens_scale / p.scale * (p.orthographic ? p.inverse_focus : 1.0);
  const double off = vertex_error(frame, drawable, resting_box(bound));
  const DVec3 axis = glm::normalize(DVec3(bound.cone_axis[0], bound.cone_axis[1], bound.cone_axis[2])) * turned;
  const auto cosine = static_cast<double>(bound.cone_cosine);
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine)) + 1e-12;
  double least = 1e300;
  for (std::size_t turn = 0; turn < (keys == 2 ? 3u : 1u); ++turn) {
    const double shift = largest_factor(turns[turn]) * (aperture + off + 1e-10 * longest);
    const DMat3 back = glm::transpose(turns[turn]);
    for (std::size_t k = 0; k < 8 * keys; ++k)
      least = std::min(least, least_product(back * at[k], axis, cosine, sine) - shift);
    if (!(least > 0)) return false;
  }

  // Compares twice the area on screen of a triangle of cross product N and edges S (scene/cluster_bounds.h) with the
  // change by rounding and snapping: |N| area > S rounding + fixed, for the least |N| / S and S. A vertex that hardly
  // moves counts as at rest.
  const double snap = 2.0 / static_cast<double>(frame.request.subpixels()) +
                      (drawable.moving ? static_cast<double>(scene::kStillPixels) : 0.0);
  const double scale2 = p.scale * p.scale, far3 = far_w * far_w * far_w, near2 = near_w * near_w;
  const double area = scale2 * least / far3;
  const double rounding = longest * stretch * (2 * off * scale2 / far3 + 4 * snap * p.scale / near2);
  const double fixed = longest * (4 * off * off * scale2 / far3 + 8 * snap * off * p.scale / near2) + 4 * snap * snap;
  const double margin = static_cast<double>(bound.least_height) * area - rounding;
  return margin > 0 && margin * static_cast<double>(bound.least_edges) > fixed;
}

}  // namespace tessera::frontend
