#include "scene/deform.h"

namespace tessera::scene {
namespace {

const Node& node_at(const Capture& capture, int node) { return capture.nodes[static_cast<std::size_t>(node)]; }

bool is_skinned(const Capture& capture, int node, const Primitive& primitive) {
  return node_at(capture, node).skin != kNone && !primitive.vertices.influences.empty();
}

void add_weighted(std::vector<Vec3>& into, const std::vector<Vec3>& differences, float weight) {
  if (differences.empty() || weight == 0.0f) return;
  for (std::size_t i = 0; i < into.size(); ++i) into[i] += differences[i] * weight;
}

void morph(const Primitive& primitive, const std::vector<float>& weights, Deformed& out) {
  const Vertices& vertices = primitive.vertices;
  out.positions = vertices.positions;
  out.normals = vertices.normals;
  out.tangents = vertices.tangents;
  for (std::size_t t = 0; t < vertices.morph_targets.size() && t < weights.size(); ++t) {
    const MorphTarget& target = vertices.morph_targets[t];
    add_weighted(out.positions, target.positions, weights[t]);
    if (!out.normals.empty()) add_weighted(out.normals, target.normals, weights[t]);
    if (!out.tangents.empty() && !target.tangents.empty())
      for (std::size_t i = 0; i < out.tangents.size(); ++i)
        out.tangents[i] += Vec4(target.tangents[i] * weights[t], 0.0f);
  }
}

void skin(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out) {
  const Skin& skin = capture.skins[static_cast<std::size_t>(node_at(capture, node).skin)];
  std::vector<Mat4> joints(skin.joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j)
    joints[j] = Mat4(pose.world[static_cast<std::size_t>(skin.joints[j])] * skin.inverse_bind[j]);
  for (std::size_t v = 0; v < out.positions.size(); ++v) {
    const SkinInfluence& influence = primitive.vertices.influences[v];
    Mat4 m(0.0f);
    for (std::size_t k = 0; k < 8; ++k)
      if (influence.weights[k] > 0.0f) m += joints[influence.joints[k]] * influence.weights[k];
    out.positions[v] = Vec3(m * Vec4(out.positions[v], 1.0f));
    // Joints rotate and scale evenly in practice; shading renormalises.
    const Mat3 linear(m);
    if (!out.normals.empty()) out.normals[v] = linear * out.normals[v];
    if (!out.tangents.empty()) out.tangents[v] = Vec4(linear * Vec3(out.tangents[v]), out.tangents[v].w);
  }
}

}  // namespace

bool is_deforming(const Capture& capture, int node, const Primitive& primitive) {
  return !primitive.vertices.morph_targets.empty() || is_skinned(capture, node, primitive);
}

void deform(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out) {
  out = Deformed{};
  if (!is_deforming(capture, node, primitive)) return;
  morph(primitive, pose.weights[static_cast<std::size_t>(node)], out);
  if (is_skinned(capture, node, primitive)) skin(capture, node, primitive, pose, out);
}

DMat4 object_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                      const Pose& pose) {
  if (is_skinned(capture, node, primitive)) return DMat4(1.0);
  const DMat4& world = pose.world[static_cast<std::size_t>(node)];
  const std::vector<InstanceTransform>& instances = node_at(capture, node).instances;
  return instances.empty() ? world : world * instance_to_node(instances[instance]);
}

}  // namespace tessera::scene
