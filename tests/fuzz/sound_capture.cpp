#include "tests/fuzz/sound_capture.h"

#include <cmath>

#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {
namespace {

using scene::Capture;
using scene::kNone;

template <class List>
bool names_one(int index, const List& list) {
  return index == kNone || (index >= 0 && static_cast<std::size_t>(index) < list.size());
}

bool finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void require_sound_primitive(const Capture& capture, const scene::Primitive& primitive) {
  const scene::Vertices& v = primitive.vertices;
  for (const std::uint32_t index : primitive.indices) require(index < v.count(), "an index names no vertex");
  for (const Vec3& p : v.positions) require(finite(p), "a position is not finite");
  for (const Vec3& n : v.normals) require(finite(n), "a normal is not finite");
  require(v.normals.empty() || v.normals.size() == v.count(), "normals are not one per vertex");
  require(v.tangents.empty() || v.tangents.size() == v.count(), "tangents are not one per vertex");
  require(v.colors.empty() || v.colors.size() == v.count(), "colours are not one per vertex");
  require(v.influences.empty() || v.influences.size() == v.count(), "influences are not one per vertex");
  for (const auto& set : v.texcoords)
    require(set.empty() || set.size() == v.count(), "texture coordinates are not one per vertex");
  for (const scene::MorphTarget& target : v.morph_targets)
    for (const auto* list : {&target.positions, &target.normals, &target.tangents})
      require(list->empty() || list->size() == v.count(), "a morph target is not one per vertex");
  if (primitive.wire != scene::Primitive::Wire::kSurface)
    require(v.count() % 4 == 0 && primitive.kind == scene::Primitive::Kind::kTriangles,
            "points and lines are not fours");
  if (primitive.kind == scene::Primitive::Kind::kTriangles)
    require(primitive.indices.size() % 3 == 0, "indices are not three per triangle");
  if (primitive.kind == scene::Primitive::Kind::kBezierPatches)
    require(v.count() % 16 == 0, "control points are not sixteen per patch");
  require(names_one(primitive.material, capture.materials), "a material is not there");
}

void require_sound_node(const Capture& capture, const scene::Node& node) {
  require(names_one(node.parent, capture.nodes), "a parent is not there");
  for (const int child : node.children)
    require(child != kNone && names_one(child, capture.nodes), "a child is not there");
  require(names_one(node.mesh, capture.meshes), "a mesh is not there");
  require(names_one(node.skin, capture.skins), "a skin is not there");
  require(names_one(node.camera, capture.cameras), "a camera is not there");
  require(names_one(node.light, capture.lights), "a light is not there");
  require(names_one(node.procedure, capture.procedures), "a procedure is not there");
  if (node.mesh == kNone || node.skin == kNone) return;
  const std::size_t joints = capture.skins[static_cast<std::size_t>(node.skin)].joints.size();
  for (const scene::Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives)
    for (const scene::SkinInfluence& influence : primitive.vertices.influences)
      for (std::size_t k = 0; k < influence.joints.size(); ++k)
        require(influence.weights[k] == 0 || influence.joints[k] < joints, "a joint is not there");
}

}  // namespace

void require_sound(const Capture& capture) {
  for (const scene::Mesh& mesh : capture.meshes)
    for (const scene::Primitive& primitive : mesh.primitives) require_sound_primitive(capture, primitive);
  for (const scene::Node& node : capture.nodes) require_sound_node(capture, node);
  for (const int root : capture.roots) require(root != kNone && names_one(root, capture.nodes), "a root is not there");
  for (const scene::Skin& skin : capture.skins) {
    require(skin.joints.size() == skin.inverse_bind.size(), "a joint has no inverse bind matrix");
    for (const int joint : skin.joints)
      require(joint != kNone && names_one(joint, capture.nodes), "a skin's joint is not there");
  }
  for (const scene::Animation& animation : capture.animations)
    for (const scene::AnimationChannel& channel : animation.channels) {
      require(names_one(channel.node, capture.nodes), "an animated node is not there");
      const bool of_node = scene::moves_node(channel.path);
      require((channel.node != kNone) == of_node && (channel.object == kNone) == of_node, "a channel moves two things");
      if (channel.path >= scene::AnimatedPath::kShapeNumbers)
        require(capture.nodes[static_cast<std::size_t>(channel.node)].procedure != kNone, "it has no procedure");
      else if (channel.path > scene::AnimatedPath::kVisible && channel.path <= scene::AnimatedPath::kTextureScale)
        require(names_one(channel.object, capture.materials), "an animated material is not there");
      else if (channel.path > scene::AnimatedPath::kVisible && channel.path <= scene::AnimatedPath::kFar)
        require(names_one(channel.object, capture.cameras), "an animated camera is not there");
      else if (!of_node)
        require(names_one(channel.object, capture.lights), "an animated light is not there");
      for (std::size_t k = 0; k < channel.times.size(); ++k)
        require(std::isfinite(channel.times[k]) && (k == 0 || channel.times[k] > channel.times[k - 1]),
                "key times do not increase");
      const std::size_t per_key = static_cast<std::size_t>(channel.components) *
                                  (channel.interpolation == scene::Interpolation::kCubicSpline ? 3 : 1);
      require(channel.values.size() == channel.times.size() * per_key, "keys and values do not match");
    }
  for (const int played : capture.played_animations)
    require(played != kNone && names_one(played, capture.animations), "a played animation is not there");
  require(capture.lights.size() == capture.light_parameters.size(), "a light has no parameters");
  require(capture.charged_bytes <= kMaxBytes, "more was charged than allowed");
}

}  // namespace tessera::fuzz
