#include "tilecore/shading/view_rays.h"

#include <cmath>

namespace tessera::tilecore {
namespace {

// Inverse times determinant: exists for every matrix, quadratic in its elements.
DMat3 adjugate(const DMat3& m) {
  return glm::transpose(DMat3(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])));
}

}  // namespace

ViewRays::ViewRays(const scene::FrameGeometry& frame) : projection_(frame.projection) {
  const DMat3 open(frame.views[0].world_to_camera), close(frame.views[1].world_to_camera);
  turning_ = open != close;
  if (!turning_) {
    to_world_[0] = DMat3(frame.views[0].camera_to_world);
    return;
  }
  // adj((1 - t) A + t B) = (1 - t)^2 adj A + t (1 - t) M + t^2 adj B, with M from t = 1/2.
  const DMat3 a = adjugate(open), b = adjugate(close), mixed = adjugate(open + close) - a - b;
  to_world_ = {a, mixed - 2.0 * a, a - mixed + b};
}

Vec3 ViewRays::direction(float x, float y, float t, float lens_u, float lens_v) const {
  const scene::Projection& p = projection_;
  const double tilt_x = static_cast<double>(lens_u) * p.inverse_focus,
               tilt_y = static_cast<double>(lens_v) * p.inverse_focus;
  DVec3 direction(-tilt_x / p.scale, tilt_y / p.scale, -1);
  if (!p.orthographic)
    direction = {(static_cast<double>(x) - p.center_x - tilt_x) / p.scale,
                 -(static_cast<double>(y) - p.center_y - tilt_y) / p.scale, -1};
  const auto time = static_cast<double>(t);
  DVec3 world = to_world_[0] * direction;
  if (turning_) world += time * (to_world_[1] * direction + time * (to_world_[2] * direction));
  const double length2 = glm::dot(world, world);
  return Vec3(length2 > 0 && std::isfinite(length2) ? world / std::sqrt(length2) : DVec3(0, 0, -1));
}

}  // namespace tessera::tilecore
