#include "gpu/moving_focus.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "scene/pose.h"

namespace tessera::gpu {
namespace {

int node_of(const scene::Capture& capture, const std::string& name) {
  int found = scene::kNone;
  const scene::Pose pose = scene::pose_at(capture, 0);
  std::vector<std::string> names;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    if (!pose.in_scene[n] || capture.nodes[n].name.empty()) continue;
    names.push_back(capture.nodes[n].name);
    if (names.back() != name) continue;
    if (found != scene::kNone)
      throw UsageError(
          fmt::format("resolve.focus_node: several nodes of the scene are called '{}'", escape_control(name, 80)));
    found = static_cast<int>(n);
  }
  if (found != scene::kNone) return found;
  const std::string nearest = nearest_name(name, names);
  throw UsageError(
      fmt::format("resolve.focus_node: no node of the scene is called '{}'{}", escape_control(name, 80),
                  nearest.empty() ? "" : fmt::format("; did you mean '{}'?", escape_control(nearest, 80))));
}

}  // namespace

MovingFocus::MovingFocus(const tilecore::FoveationSettings& settings, const scene::Capture& capture)
    : fixed_(settings.focus_x, settings.focus_y), capture_(&capture) {
  if (!settings.focus_node.empty()) node_ = node_of(capture, settings.focus_node);
}

DVec2 MovingFocus::at(double seconds, const scene::CameraChoice& camera, int width, int height) const {
  if (node_ == scene::kNone) return fixed_;
  const scene::Pose pose = scene::pose_at(*capture_, seconds);
  const scene::Projection projection = scene::make_projection(camera.at(*capture_, seconds), width, height);
  const DVec4 there = projection.matrix() * (camera.view(pose).world_to_camera *
                                             pose.world[static_cast<std::size_t>(node_)] * DVec4(0, 0, 0, 1));
  if (!(there.w > 0) || !(there.z > 0)) return fixed_;
  return {there.x / there.w / width, there.y / there.w / height};
}

}  // namespace tessera::gpu
