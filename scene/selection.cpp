#include "scene/selection.h"

#include <algorithm>

#include "scene/framing.h"
#include "scene/pose.h"
#include "scene/view.h"

namespace tessera::scene {

int camera_node(const Capture& capture) {
  if (capture.settings.camera_node != kNone) return capture.settings.camera_node;
  const Pose pose = pose_at(capture, capture.settings.first_frame / capture.settings.frame_rate);
  for (std::size_t n = 0; n < capture.nodes.size(); ++n)
    if (capture.nodes[n].camera != kNone && pose.in_scene[n]) return static_cast<int>(n);
  return kNone;
}

void add_framing_camera(Capture& capture, int width, int height, const std::optional<Orbit>& orbit) {
  const CameraChoice choice = frame_scene(capture, width, height, orbit);
  Node node;
  node.name = "automatic";
  node.matrix = choice.fixed_world;
  node.camera = static_cast<int>(capture.cameras.size());
  capture.cameras.push_back(choice.camera);
  capture.cameras.back().name = node.name;
  capture.settings.camera_node = static_cast<int>(capture.nodes.size());
  capture.roots.push_back(capture.settings.camera_node);
  capture.nodes.push_back(std::move(node));
}

void set_lens(Capture& capture, Lens lens, int width, int height) {
  if (camera_node(capture) == kNone) add_framing_camera(capture, width, height);
  const auto node = static_cast<std::size_t>(camera_node(capture));
  Camera& camera = capture.cameras[static_cast<std::size_t>(capture.nodes[node].camera)];
  if (lens.aperture_radius > 0 && !(lens.focus_distance > 0)) {
    const double time = capture.settings.first_frame / capture.settings.frame_rate;
    const DMat4 world = view_from_world(pose_at(capture, time).world[node]).camera_to_world;
    lens.focus_distance =
        static_cast<float>(std::max(middle_distance(capture, world, time), static_cast<double>(camera.near)));
  }
  camera.lens = lens;
}

}  // namespace tessera::scene
