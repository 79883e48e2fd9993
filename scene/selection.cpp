#include "scene/selection.h"

#include "scene/pose.h"

namespace tessera::scene {

int camera_node(const Capture& capture) {
  if (capture.settings.camera_node != kNone) return capture.settings.camera_node;
  const Pose pose = pose_at(capture, capture.settings.first_frame / capture.settings.frame_rate);
  for (std::size_t n = 0; n < capture.nodes.size(); ++n)
    if (capture.nodes[n].camera != kNone && pose.in_scene[n]) return static_cast<int>(n);
  return kNone;
}

}  // namespace tessera::scene
