#include "scene/pose.h"

#include <algorithm>
#include <cmath>

namespace tessera::scene {
namespace {

DMat4 matrix_of(const Transform& t) {
  DMat4 m = glm::mat4_cast(t.rotation);
  for (int c = 0; c < 3; ++c) m[c] *= t.scale[c];
  m[3] = DVec4(t.translation, 1.0);
  return m;
}

DQuat quaternion(const std::vector<double>& v) { return glm::normalize(DQuat(v[3], v[0], v[1], v[2])); }

}  // namespace

DMat4 instance_to_node(const InstanceTransform& instance) {
  const auto& [t, r, s] = instance;
  return matrix_of(
      {DVec3(t[0], t[1], t[2]), glm::normalize(DQuat(glm::quat(r[3], r[0], r[1], r[2]))), DVec3(s[0], s[1], s[2])});
}

std::vector<double> evaluate_channel(const AnimationChannel& channel, double time) {
  const auto n = static_cast<std::size_t>(channel.components);
  const bool cubic = channel.interpolation == Interpolation::kCubicSpline;
  // Part 0 of a cubic key is the in-tangent, 1 the value, 2 the out-tangent.
  const auto part = [&](std::size_t key, std::size_t which) {
    const float* begin = &channel.values[(cubic ? 3 * key + which : key) * n];
    return std::vector<double>(begin, begin + n);
  };
  const auto after = std::upper_bound(channel.times.begin(), channel.times.end(), time,
                                      [](double t, float key) { return t < static_cast<double>(key); });
  if (after == channel.times.begin()) return part(0, 1);
  const auto key = static_cast<std::size_t>(after - channel.times.begin()) - 1;
  if (after == channel.times.end() || channel.interpolation == Interpolation::kStep) return part(key, 1);

  const double begin = static_cast<double>(channel.times[key]),
               span = static_cast<double>(channel.times[key + 1]) - begin;
  const double s = std::clamp((time - begin) / span, 0.0, 1.0);
  const std::vector<double> a = part(key, 1), b = part(key + 1, 1);
  std::vector<double> out(n);
  if (cubic) {
    const std::vector<double> out_tangent = part(key, 2), in_tangent = part(key + 1, 0);
    const double s2 = s * s, s3 = s2 * s;
    for (std::size_t i = 0; i < n; ++i)
      out[i] = (2 * s3 - 3 * s2 + 1) * a[i] + span * (s3 - 2 * s2 + s) * out_tangent[i] + (3 * s2 - 2 * s3) * b[i] +
               span * (s3 - s2) * in_tangent[i];
  } else if (channel.path == AnimatedPath::kRotation) {
    const DQuat q = glm::slerp(quaternion(a), quaternion(b), s);
    out = {q.x, q.y, q.z, q.w};
  } else {
    for (std::size_t i = 0; i < n; ++i) out[i] = a[i] * (1 - s) + b[i] * s;
  }
  return out;
}

Pose pose_at(const Capture& capture, double time) {
  const std::size_t count = capture.nodes.size();
  std::vector<Transform> local(count);
  Pose pose;
  pose.world.assign(count, DMat4(1.0));
  pose.in_scene.assign(count, false);
  pose.visible.assign(count, true);
  pose.weights.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    const Node& node = capture.nodes[n];
    local[n] = node.transform;
    pose.visible[n] = node.visible;
    if (node.mesh == kNone) continue;
    pose.weights[n] =
        node.weights.empty() ? capture.meshes[static_cast<std::size_t>(node.mesh)].default_weights : node.weights;
  }

  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels) {
      if (channel.node == kNone) continue;
      const auto n = static_cast<std::size_t>(channel.node);
      const std::vector<double> v = evaluate_channel(channel, time);
      switch (channel.path) {
        case AnimatedPath::kTranslation:
          local[n].translation = {v[0], v[1], v[2]};
          break;
        case AnimatedPath::kRotation:
          local[n].rotation = quaternion(v);
          break;
        case AnimatedPath::kScale:
          local[n].scale = {v[0], v[1], v[2]};
          break;
        case AnimatedPath::kWeights:
          pose.weights[n].assign(v.begin(), v.end());
          break;
        case AnimatedPath::kVisible:
          pose.visible[n] = v[0] != 0;
          break;
        default:
          break;
      }
    }

  // Parents before children, without recursion: a file may chain any number of nodes. Joints may lie outside the
  // drawn scene, so every tree is walked.
  std::vector<int> stack;
  for (std::size_t n = 0; n < count; ++n)
    if (capture.nodes[n].parent == kNone) stack.push_back(static_cast<int>(n));
  for (const int root : capture.roots) pose.in_scene[static_cast<std::size_t>(root)] = true;
  while (!stack.empty()) {
    const auto n = static_cast<std::size_t>(stack.back());
    stack.pop_back();
    const Node& node = capture.nodes[n];
    const DMat4 m = node.matrix ? *node.matrix : matrix_of(local[n]);
    if (node.parent == kNone) {
      pose.world[n] = m;
    } else {
      pose.world[n] = pose.world[static_cast<std::size_t>(node.parent)] * m;
      if (pose.in_scene[static_cast<std::size_t>(node.parent)]) pose.in_scene[n] = true;
      if (!pose.visible[static_cast<std::size_t>(node.parent)]) pose.visible[n] = false;
    }
    stack.insert(stack.end(), node.children.begin(), node.children.end());
  }
  return pose;
}

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

// Takes a skin's joints from where they bind to world space.
DMat4 joint_matrix(const Skin& skin, const Pose& pose, std::size_t joint) {
  return pose.world[static_cast<std::size_t>(skin.joints[joint])] * skin.inverse_bind[joint];
}

const Skin& skin_of(const Capture& capture, int node) {
  return capture.skins[static_cast<std::size_t>(node_at(capture, node).skin)];
}

// Origin of a skinned mesh's posed vertices, in world space: where its heaviest joint has the first vertex that is drawn.
// Differences from it are as small as the mesh, so that floats hold them as well as they hold vertices of a rigid mesh.
DVec3 skin_origin(const Capture& capture, int node, const Primitive& primitive, const Pose& pose) {
  const Vertices& vertices = primitive.vertices;
  const std::size_t first = primitive.indices.empty() ? 0 : primitive.indices.front();
  if (first >= vertices.influences.size()) return DVec3(0.0);
  const SkinInfluence& influence = vertices.influences[first];
  const auto heaviest =
      static_cast<std::size_t>(std::ranges::max_element(influence.weights) - influence.weights.begin());
  const DMat4 m = joint_matrix(skin_of(capture, node), pose, influence.joints[heaviest]);
  const DVec3 origin(m * DVec4(DVec3(vertices.positions[first]), 1.0));
  return std::isfinite(origin.x + origin.y + origin.z) ? origin : DVec3(0.0);
}

void skin(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out) {
  const Skin& skin = skin_of(capture, node);
  const DVec3 origin = skin_origin(capture, node, primitive, pose);
  std::vector<DMat4> joints(skin.joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j] = joint_matrix(skin, pose, j);
    joints[j][3] -= DVec4(origin, 0.0);
  }
  for (std::size_t v = 0; v < out.positions.size(); ++v) {
    const SkinInfluence& influence = primitive.vertices.influences[v];
    DMat4 m(0.0);
    for (std::size_t k = 0; k < 8; ++k)
      if (influence.weights[k] > 0.0f) m += joints[influence.joints[k]] * static_cast<double>(influence.weights[k]);
    out.positions[v] = Vec3(m * DVec4(DVec3(out.positions[v]), 1.0));
    const DMat3 linear(m);
    if (!out.normals.empty()) out.normals[v] = Vec3(turn_normals(linear) * DVec3(out.normals[v]));
    if (!out.tangents.empty()) out.tangents[v] = Vec4(Vec3(linear * DVec3(Vec3(out.tangents[v]))), out.tangents[v].w);
  }
}

}  // namespace

DMat3 turn_normals(const DMat3& linear) {
  const DMat3 cofactors(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                        glm::cross(linear[0], linear[1]));
  const double determinant = glm::dot(linear[0], cofactors[0]);
  if (determinant != 0) return cofactors * (std::cbrt(std::abs(determinant)) / determinant);
  return cofactors == DMat3(0.0) ? DMat3(1.0) : cofactors;
}

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
  if (is_skinned(capture, node, primitive)) {
    DMat4 out(1.0);
    out[3] = DVec4(skin_origin(capture, node, primitive, pose), 1.0);
    return out;
  }
  const DMat4& world = pose.world[static_cast<std::size_t>(node)];
  const std::vector<InstanceTransform>& instances = node_at(capture, node).instances;
  return instances.empty() ? world : world * instance_to_node(instances[instance]);
}

double winding_determinant(const Capture& capture, int node, std::size_t instance, const Pose& pose) {
  const DMat3 world(pose.world[static_cast<std::size_t>(node)]);
  const std::vector<InstanceTransform>& instances = node_at(capture, node).instances;
  return glm::determinant(instances.empty() ? world : world * DMat3(instance_to_node(instances[instance])));
}

}  // namespace tessera::scene
