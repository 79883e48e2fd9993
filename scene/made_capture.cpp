#include "scene/made_capture.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera::scene::made {

void play(Capture& capture, const AnimationChannel& channel) {
  if (capture.animations.empty()) {
    capture.animations.emplace_back();
    capture.played_animations = {0};
  }
  capture.animations[0].channels.push_back(channel);
}

int add_material(Capture& capture, Material material) {
  capture.materials.push_back(std::move(material));
  return static_cast<int>(capture.materials.size()) - 1;
}

int add_node(Capture& capture, Primitive primitive, const DVec3& translation) {
  Mesh mesh;
  mesh.default_weights.resize(primitive.vertices.morph_targets.size(), 0.0f);
  mesh.primitives.push_back(std::move(primitive));
  capture.meshes.push_back(std::move(mesh));
  Node node;
  node.mesh = static_cast<int>(capture.meshes.size()) - 1;
  node.transform.translation = translation;
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture.roots.back();
}

int add_camera(Capture& capture, const DVec3& eye, const Camera& camera) {
  capture.cameras.push_back(camera);
  Node node;
  node.camera = static_cast<int>(capture.cameras.size()) - 1;
  node.transform.translation = eye;
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture.roots.back();
}

DQuat looking(const DVec3& direction) {
  const DVec3 back = -glm::normalize(direction),
              right = glm::normalize(glm::cross(std::abs(back.y) < 0.99 ? DVec3(0, 1, 0) : DVec3(0, 0, -1), back));
  return glm::quat_cast(DMat3(right, glm::cross(back, right), back));
}

int add_light(Capture& capture, const shaders::Light& light, const DVec3& place, const DVec3& direction,
              const ShadowRequest& maps) {
  capture.lights.push_back(light);
  capture.light_parameters.push_back({.color = light.color,
                                      .inner_cone = std::acos(static_cast<double>(light.cos_inner)),
                                      .outer_cone = std::acos(static_cast<double>(light.cos_outer))});
  Node node;
  node.light = static_cast<int>(capture.lights.size()) - 1;
  node.transform.translation = place;
  node.transform.rotation = looking(direction);
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  capture.settings.shadows.push_back(maps);
  capture.settings.shadows.back().light = node.light;
  return capture.roots.back();
}

void add_morph(Capture& capture, int node) {
  capture.nodes[static_cast<std::size_t>(node)].weights = {0.0f};
  play(capture, {.node = node, .path = AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
}

Primitive triangles(std::vector<Vec3> positions, std::vector<std::uint32_t> indices, int material) {
  Primitive primitive;
  primitive.vertices.positions = std::move(positions);
  primitive.indices = std::move(indices);
  primitive.material = material;
  return primitive;
}

Primitive patches(std::vector<Vec3> control_points, int material) {
  Primitive primitive;
  primitive.kind = Primitive::Kind::kBezierPatches;
  std::vector<Vec2> texcoords;
  for (std::size_t i = 0; i < control_points.size(); ++i)
    texcoords.emplace_back(static_cast<float>(i % 4) / 3.0f, static_cast<float>(i % 16 / 4) / 3.0f);
  primitive.vertices.positions = std::move(control_points);
  primitive.vertices.texcoords = {texcoords};
  primitive.material = material;
  return primitive;
}

std::vector<Vec3> flat_patch(const Vec3& origin, const Vec3& a, const Vec3& b) {
  std::vector<Vec3> points;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      points.push_back(origin + a * (static_cast<float>(i) / 3.0f) + b * (static_cast<float>(j) / 3.0f));
  return points;
}

Primitive closed_patches(int material) {
  std::vector<Vec3> points;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f})
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          // Grid coordinates are exact thirds of integers, so that faces share their edge points bit by bit.
          const float s[4] = {-1.0f, -0.4f, 0.4f, 1.0f};
          Vec3 p;
          p[axis] = side;
          p[(axis + 1) % 3] = side > 0 ? s[i] : s[3 - i];
          p[(axis + 2) % 3] = s[j];
          // Push inner points outwards; edges are bent alike from both faces because the formula is symmetric.
          const float bulge = 1.0f / std::max(1.0f, std::sqrt((p.x * p.x + p.y * p.y) + p.z * p.z) * 0.75f);
          points.push_back(p * bulge);
        }
  return patches(points, material);
}

}  // namespace tessera::scene::made
