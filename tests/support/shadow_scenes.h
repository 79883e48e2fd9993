#pragma once

#include <vector>

#include "scene/made_capture.h"
#include "tests/support/captures.h"

namespace tessera::test {

// Scenes whose shadows have closed forms: things over a white floor, seen from straight above.

inline constexpr double kFloorHalf = 4;  // half the side of the camera's view, scene units

inline scene::Material matt_white() {
  scene::Material m;
  m.metallic = 0, m.roughness = 1;
  m.double_sided = true;
  return m;
}

// A rectangle of the plane y = 0.
inline scene::Primitive rectangle(const DVec2& low, const DVec2& high, int material) {
  const Vec2 a(low), b(high);
  return triangles({{a.x, 0, b.y}, {b.x, 0, b.y}, {b.x, 0, a.y}, {a.x, 0, a.y}}, {0, 1, 2, 0, 2, 3}, material);
}

// The floor y = 0 alone, without any light.
struct FloorScene {
  scene::Capture capture;
  int floor = 0, camera = 0, white = 0;

  FloorScene() {
    white = add_material(capture, matt_white());
    floor = add_node(capture, rectangle(DVec2(-3 * kFloorHalf), DVec2(3 * kFloorHalf), white));
    scene::Camera lens;
    lens.type = scene::Camera::Type::kOrthographic;
    lens.x_mag = lens.y_mag = static_cast<float>(kFloorHalf);
    camera = add_camera(capture, {0, 10, 0}, lens);
    capture.nodes[static_cast<std::size_t>(camera)].transform.rotation = scene::made::looking({0, -1, 0});
    capture.settings.environment = 0.0f;
    capture.settings.background = Vec3(0.0f);
  }
  // A square over the floor, parallel to it.
  int add_card(const DVec3& at, double half) {
    return add_node(capture, rectangle(DVec2(-half), DVec2(half), white), at);
  }
  void move(const DVec3& away) {
    for (scene::Node& node : capture.nodes) node.transform.translation += away;
  }
};

// The place on the floor of a point of an image of `side` pixels: x to the right, z down.
inline DVec2 floor_place(double x, double y, int side) {
  return DVec2(x - side / 2.0, y - side / 2.0) * (2 * kFloorHalf / side);
}

}  // namespace tessera::test
