#include "scene/wires.h"

#include <cmath>

namespace tessera::scene {
namespace {

// Unit vector of the image, in pixels (y down), across the segment from a to b in camera space. A segment that points
// at the eye has none and gets some.
glm::dvec2 across(const DVec3& a, const DVec3& b, bool orthographic) {
  // In perspective the line's normal is the normal of the plane through the line and the eye, wherever its ends lie.
  const DVec3 plane = orthographic ? glm::cross(DVec3(0, 0, -1), b - a) : glm::cross(a, b);
  const double length = std::hypot(plane.x, plane.y);
  return length > 0 && std::isfinite(length) ? glm::dvec2(plane.x, -plane.y) / length : glm::dvec2(0, 1);
}

}  // namespace

DMat4 vertices_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                        const Pose& pose, const View& view) {
  if (primitive.wire == Primitive::Wire::kSurface) return object_to_world(capture, node, instance, primitive, pose);
  DMat4 out(1.0);
  out[3] = view.camera_to_world[3];
  return out;
}

void spread_wires(const Primitive& primitive, const DMat4& to_world, const View& view, const Projection& projection,
                  Deformed& deformed) {
  const Vertices& rest = primitive.vertices;
  if (deformed.positions.empty()) {
    deformed.positions = rest.positions;
    deformed.normals = rest.normals;
    deformed.tangents = rest.tangents;
  }
  const DMat4 to_camera = view.world_to_camera * to_world;
  const DMat3 turn(view.camera_to_world);  // camera space to the posed vertices' space
  const DMat3 linear(to_world);
  const double determinant = glm::determinant(linear);
  const DMat3 normal_to_world = determinant != 0 ? glm::transpose(glm::inverse(linear)) : DMat3(1.0);
  const auto camera = [&](std::size_t v) { return DVec3(to_camera * DVec4(DVec3(deformed.positions[v]), 1.0)); };
  for (std::size_t first = 0; first + 4 <= deformed.positions.size(); first += 4) {
    const DVec3 a = camera(first), b = camera(first + 2);
    std::array<glm::dvec2, 4> offset;  // pixels
    if (primitive.wire == Primitive::Wire::kPoints) {
      offset = {glm::dvec2(-0.5, -0.5), glm::dvec2(-0.5, 0.5), glm::dvec2(0.5, 0.5), glm::dvec2(0.5, -0.5)};
    } else {
      const glm::dvec2 half = 0.5 * across(a, b, projection.orthographic);
      offset = {-half, half, half, -half};
    }
    for (std::size_t k = 0; k < 4; ++k) {
      DVec3 p = k < 2 ? a : b;
      const double w = projection.orthographic ? 1.0 : -p.z;
      p.x += offset[k].x * w / projection.scale;
      p.y -= offset[k].y * w / projection.scale;
      deformed.positions[first + k] = Vec3(turn * p);
    }
  }
  for (Vec3& normal : deformed.normals) normal = Vec3(normal_to_world * DVec3(normal));
  for (Vec4& tangent : deformed.tangents) tangent = Vec4(Vec3(linear * DVec3(Vec3(tangent))), tangent.w);
}

}  // namespace tessera::scene
