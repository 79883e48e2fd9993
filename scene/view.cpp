#include "scene/view.h"

#include <algorithm>
#include <cmath>

#include "scene/animation.h"
#include "scene/framing.h"

namespace tessera::scene {

DMat4 Projection::matrix() const {
  DMat4 m(0.0);  // m[column][row]
  m[0][0] = scale;
  m[1][1] = -scale;
  m[2][2] = -1;  // depth
  if (orthographic) {
    m[3][0] = center_x;
    m[3][1] = center_y;
    m[3][3] = 1;
  } else {
    m[2][0] = -center_x;
    m[2][1] = -center_y;
    m[2][3] = -1;
  }
  return m;
}

DMat4 Projection::unprojection() const {
  DMat4 m(0.0);  // m[column][row]
  m[0][0] = 1.0 / scale;
  m[1][1] = -1.0 / scale;
  m[2][2] = -1.0;
  m[3][3] = 1.0;
  const auto column = orthographic ? 3 : 2;  // the factor of the image's middle: 1, or w, which is the depth
  m[column][0] = -center_x / scale;
  m[column][1] = center_y / scale;
  return m;
}

Projection make_projection(const Camera& camera, int width, int height) {
  Projection p;
  p.center_x = width * 0.5;
  p.center_y = height * 0.5;
  p.near = static_cast<double>(camera.near);
  p.far = static_cast<double>(camera.far);
  p.orthographic = camera.type == Camera::Type::kOrthographic;
  // Square pixels always: a frame of another aspect shows more or less, never a stretched image.
  if (p.orthographic)
    p.scale = std::min(p.center_x / static_cast<double>(camera.x_mag), p.center_y / static_cast<double>(camera.y_mag));
  else
    p.scale = p.center_y / std::tan(static_cast<double>(camera.vertical_fov) * 0.5);
  p.lens_scale = p.scale * static_cast<double>(camera.lens.aperture_radius);
  if (camera.lens.aperture_radius > 0) p.inverse_focus = 1.0 / static_cast<double>(camera.lens.focus_distance);
  return p;
}

View view_from_world(const DMat4& camera_world) {
  const DVec3 back_raw(camera_world[2]), up_raw(camera_world[1]);
  const double back_length = glm::length(back_raw);
  const DVec3 back = back_length > 0 ? back_raw / back_length : DVec3(0, 0, 1);
  DVec3 right = glm::cross(up_raw, back);
  if (!(glm::length(right) > 0))
    right = std::abs(back.y) < 0.9 ? glm::cross(DVec3(0, 1, 0), back) : glm::cross(DVec3(1, 0, 0), back);
  right = glm::normalize(right);
  const DVec3 up = glm::cross(back, right), position(camera_world[3]);
  View view;
  view.camera_to_world = DMat4(DVec4(right, 0), DVec4(up, 0), DVec4(back, 0), DVec4(position, 1));
  view.world_to_camera =
      DMat4(DVec4(right.x, up.x, back.x, 0), DVec4(right.y, up.y, back.y, 0), DVec4(right.z, up.z, back.z, 0),
            DVec4(-glm::dot(right, position), -glm::dot(up, position), -glm::dot(back, position), 1));
  return view;
}

View CameraChoice::view(const Pose& pose) const {
  View view = view_from_world(node == kNone ? fixed_world : pose.world[static_cast<std::size_t>(node)]);
  if (eye_offset == 0) return view;
  view.camera_to_world[3] += view.camera_to_world[0] * eye_offset;
  view.world_to_camera[3].x -= eye_offset;
  return view;
}

Camera CameraChoice::at(const Capture& capture, double time) const {
  const int number = node == kNone ? kNone : capture.nodes[static_cast<std::size_t>(node)].camera;
  return number == kNone ? camera : animate_camera(capture, time, number, camera);
}

CameraChoice choose_camera(const Capture& capture, int width, int height) {
  int node = capture.settings.camera_node;
  if (node == kNone) {
    const Pose pose = pose_at(capture, capture.settings.first_frame / capture.settings.frame_rate);
    for (std::size_t n = 0; n < capture.nodes.size() && node == kNone; ++n)
      if (capture.nodes[n].camera != kNone && pose.in_scene[n]) node = static_cast<int>(n);
  }
  if (node == kNone) return frame_scene(capture, width, height);
  CameraChoice choice;
  choice.node = node;
  choice.camera = capture.cameras[static_cast<std::size_t>(capture.nodes[static_cast<std::size_t>(node)].camera)];
  return choice;
}

}  // namespace tessera::scene
