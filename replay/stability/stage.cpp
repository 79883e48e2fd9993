#include "replay/stability/stage.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tessera::replay::stability {

using scene::AlphaMode;
using scene::AnimatedPath;
using scene::AnimationChannel;
using scene::Camera;
using scene::Material;
using scene::Node;
using scene::Primitive;
using scene::Skin;
using scene::Transform;
using scene::Vertices;

float FixedRandom::uniform(float low, float high) {
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return low + (high - low) * static_cast<float>((z ^ (z >> 31)) >> 40) * 0x1p-24f;
}

Vec3 FixedRandom::in_box(float half) {
  const float x = uniform(-half, half), y = uniform(-half, half), z = uniform(-half, half);
  return {x, y, z};
}

Stage::Stage() {
  capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.02f, 0.03f, 0.05f);
}

int Stage::material(const Material& material) { return scene::made::add_material(capture, material); }

int Stage::flat(const Vec4& color, AlphaMode mode) {
  Material one;
  one.unlit = one.double_sided = true;
  one.base_color = color;
  one.alpha_mode = mode;
  return material(one);
}

int Stage::displaced(float scale, float bias, std::uint32_t seed) {
  FixedRandom random(seed);
  std::vector<float> heights(64);
  for (float& h : heights) h = random.uniform(-1, 1);
  Material one;
  one.double_sided = true;
  one.metallic = 0;
  one.roughness = 0.6f;
  one.base_color = {0.8f, 0.5f, 0.25f, 1};
  one.displacement.emplace();
  one.displacement->texture = std::make_shared<shaders::ScalarTexture>(8, 8, std::move(heights));
  one.displacement->scale = scale;
  one.displacement->bias = bias;
  return material(one);
}

int Stage::add(Primitive primitive, const DVec3& at) {
  return scene::made::add_node(capture, std::move(primitive), at);
}

int Stage::look(const DVec3& eye, const Camera& camera) { return scene::made::add_camera(capture, eye, camera); }

int Stage::look_flat() {
  Camera camera;
  camera.type = Camera::Type::kOrthographic;
  camera.x_mag = 0.5f * static_cast<float>(width), camera.y_mag = 0.5f * static_cast<float>(height);
  camera.near = 0.1f, camera.far = 200;
  return look({0, 0, 100}, camera);
}

int Stage::below(const Transform& transform) {
  const int parent = static_cast<int>(capture.nodes.size());
  Node root;
  root.transform = transform;
  root.children = capture.roots;
  for (const int child : capture.roots) node(child).parent = parent;
  capture.roots = {parent};
  capture.nodes.push_back(root);
  return parent;
}

void Stage::play(const AnimationChannel& channel) { scene::made::play(capture, channel); }

void Stage::move(int number, const DVec3& way) {
  const Vec3 from(node(number).transform.translation), to(node(number).transform.translation + way);
  play({.node = number, .times = {0, 1}, .values = {from.x, from.y, from.z, to.x, to.y, to.z}});
}

void Stage::turn(int number, const Vec3& axis, double turns) {
  AnimationChannel channel{.node = number, .path = AnimatedPath::kRotation, .components = 4, .times = {}, .values = {}};
  const int steps = std::max(1, static_cast<int>(std::ceil(3 * turns)));
  for (int k = 0; k <= steps; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(steps));
    const double half = std::numbers::pi * turns * k / steps;
    const DVec3 part = glm::normalize(DVec3(axis)) * std::sin(half);
    for (const double v : {part.x, part.y, part.z, std::cos(half)}) channel.values.push_back(static_cast<float>(v));
  }
  play(channel);
}

void Stage::zigzag(int number, AnimatedPath path, const std::vector<float>& a, const std::vector<float>& b,
                   int cycles) {
  AnimationChannel channel{
      .node = number, .path = path, .components = static_cast<int>(a.size()), .times = {}, .values = {}};
  for (int k = 0; k <= 2 * cycles; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(2 * cycles));
    const std::vector<float>& at = k % 2 == 0 ? a : b;
    channel.values.insert(channel.values.end(), at.begin(), at.end());
  }
  play(channel);
}

void Stage::morph(int number) { scene::made::add_morph(capture, number); }

int Stage::skin(int number, int joints, float low, float high) {
  const int first = static_cast<int>(capture.nodes.size());
  Skin one;
  for (int j = 0; j < joints; ++j) {
    one.joints.push_back(first + j);
    one.inverse_bind.emplace_back(1.0);
    capture.nodes.emplace_back();
    capture.roots.push_back(first + j);
  }
  Vertices& vertices = capture.meshes[static_cast<std::size_t>(node(number).mesh)].primitives[0].vertices;
  vertices.influences.resize(vertices.count());
  for (std::size_t v = 0; v < vertices.count(); ++v) {
    const float place = joints == 1 ? 0.0f
                                    : std::clamp((vertices.positions[v].x - low) / (high - low), 0.0f, 1.0f) *
                                          static_cast<float>(joints - 1);
    const int joint = std::min(static_cast<int>(place), std::max(0, joints - 2));
    const float second = place - static_cast<float>(joint);
    vertices.influences[v].joints = {static_cast<std::uint16_t>(joint),
                                     static_cast<std::uint16_t>(joints == 1 ? 0 : joint + 1)};
    vertices.influences[v].weights = {1 - second, second};
  }
  node(number).skin = static_cast<int>(capture.skins.size());
  capture.skins.push_back(std::move(one));
  return first;
}

Primitive quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material) {
  return triangles({a, b, c, d}, {0, 1, 2, 0, 2, 3}, material);
}

Primitive sheet(int columns, int rows, Vec2 low, Vec2 high, int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      positions.emplace_back(low.x + (high.x - low.x) * static_cast<float>(i) / static_cast<float>(columns),
                             low.y + (high.y - low.y) * static_cast<float>(j) / static_cast<float>(rows), 0.0f);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (columns + 1) + i), row = static_cast<std::uint32_t>(columns + 1);
      indices.insert(indices.end(), {a, a + 1, a + row + 1, a, a + row + 1, a + row});
    }
  return triangles(std::move(positions), std::move(indices), material);
}

}  // namespace tessera::replay::stability
