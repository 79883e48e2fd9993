#include "tests/support/fault_scenes.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

using scene::AnimatedPath;
using scene::Capture;

// A mesh over (u, v) in the unit square; wound so that its front is where du x dv points.
scene::Primitive mesh_of(int columns, int rows, const std::function<Vec3(float, float)>& point, int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      positions.push_back(
          point(static_cast<float>(i) / static_cast<float>(columns), static_cast<float>(j) / static_cast<float>(rows)));
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (columns + 1) + i), b = a + 1,
                 c = a + static_cast<std::uint32_t>(columns) + 1, d = c + 1;
      indices.insert(indices.end(), {a, b, d, a, d, c});
    }
  return triangles(std::move(positions), std::move(indices), material);
}

// Vertex normals of such a mesh, from its neighbours.
std::vector<Vec3> normals_of(const std::function<Vec3(float, float)>& point, int columns, int rows) {
  std::vector<Vec3> normals;
  constexpr float kStep = 1e-3f;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(columns),
                  v = static_cast<float>(j) / static_cast<float>(rows);
      normals.push_back(glm::normalize(
          glm::cross(point(u + kStep, v) - point(u - kStep, v), point(u, v + kStep) - point(u, v - kStep))));
    }
  return normals;
}

scene::Material plain_material(const Vec3& color, float metallic, float roughness) {
  scene::Material material;
  material.base_color = Vec4(color, 1.0f);
  material.metallic = metallic, material.roughness = roughness;
  material.double_sided = true;
  return material;
}

void set_frame_size(Capture& capture) { capture.settings.width = kFaultWidth, capture.settings.height = kFaultHeight; }

scene::AnimationChannel channel_of(AnimatedPath path, int components, std::vector<float> times,
                                   std::vector<float> values) {
  scene::AnimationChannel channel;
  channel.path = path;
  channel.components = components;
  channel.times = std::move(times);
  channel.values = std::move(values);
  return channel;
}

void add_channel(Capture& capture, const scene::AnimationChannel& channel) {
  if (capture.animations.empty()) {
    capture.animations.emplace_back();
    capture.played_animations = {0};
  }
  capture.animations[0].channels.push_back(channel);
}

}  // namespace

Capture turning_normals() {
  Capture capture;
  set_frame_size(capture);
  const auto wall = [](float u, float v) { return Vec3(8.0f * u - 4.0f, 4.5f * v - 2.25f, 0.0f); };
  scene::Primitive primitive =
      mesh_of(16, 9, wall, add_material(capture, plain_material(Vec3(0.9f, 0.7f, 0.4f), 1.0f, 0.3f)));
  scene::MorphTarget target;
  for (const Vec3& p : primitive.vertices.positions) {
    primitive.vertices.normals.push_back({0.0f, 0.0f, 1.0f});
    target.normals.push_back({0.8f * std::sin(p.x), 0.8f * std::cos(2.0f * p.y), 0.0f});
  }
  primitive.vertices.morph_targets.push_back(target);
  const int node = add_node(capture, primitive);
  add_camera(capture, {0, 0, 5});
  scene::AnimationChannel weights = channel_of(AnimatedPath::kWeights, 1, {0.0f, 1.0f}, {0.0f, 3.0f});
  weights.node = node;
  add_channel(capture, weights);
  return capture;
}

Capture changing_colour() {
  Capture capture;
  set_frame_size(capture);
  for (const float x : {-4.0f, 0.0f})
    add_node(capture, mesh_of(
                          4, 4, [&](float u, float v) { return Vec3(x + 4.0f * u, 5.0f * v - 2.5f, 0.0f); },
                          add_material(capture, plain_material(Vec3(0.5f), 0.0f, 0.6f))));
  add_camera(capture, {0, 0, 5});
  scene::AnimationChannel color =
      channel_of(AnimatedPath::kMaterialNumber, 4, {0.0f, 1.0f}, {0.5f, 0.5f, 0.5f, 1, 0.9f, 0.1f, 0.1f, 1});
  color.object = 1, color.part = material_number("/pbrMetallicRoughness/baseColorFactor");
  add_channel(capture, color);
  return capture;
}

Capture walk_with_a_cut() {
  Capture capture = scene::read_capture(shipped_capture("stroll"));
  for (auto& animation : capture.animations)
    for (auto& channel : animation.channels) {
      channel.interpolation = scene::Interpolation::kStep;
      channel.times = {0.0f, 1.0f};
      const auto n = static_cast<std::ptrdiff_t>(channel.components);
      std::vector<float> ends(channel.values.begin(), channel.values.begin() + n);
      ends.insert(ends.end(), channel.values.end() - n, channel.values.end());
      channel.values = ends;
    }
  return capture;
}

Capture board_that_stops() {
  Capture capture;
  set_frame_size(capture);
  scene::Material material = plain_material(Vec3(1.0f), 0.0f, 0.7f);
  Image8 grain(64, 64, 3);
  Random random(7);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (std::size_t k = 0; k < 3; ++k) grain.at(x, y)[k] = static_cast<std::uint8_t>(random.integer(80, 220));
  material.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{grain}, shaders::ColorSpace::kSrgb);
  scene::Primitive board = mesh_of(
      1, 1, [](float u, float v) { return Vec3(4.0f * u - 2.0f, 4.0f * v - 2.0f, 0.0f); },
      add_material(capture, material));
  board.vertices.texcoords = {{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  const int node = add_node(capture, board);
  add_camera(capture, {0, 0, 6});
  scene::AnimationChannel way =
      channel_of(AnimatedPath::kTranslation, 3, {0.0f, 10.0f / 30.0f, 2.0f}, {-1.5f, 0, 0, 0.5f, 0, 0, 0.5f, 0, 0});
  way.node = node;
  add_channel(capture, way);
  return capture;
}

Capture bowl_of_brass() {
  Capture capture;
  set_frame_size(capture);
  const auto bowl = [](float u, float v) {
    const float angle = 2.0f * std::numbers::pi_v<float> * u;
    // A profile up the outside, over the lip and down the inside.
    const float s = 2.0f * v - 1.0f, radius = 1.3f - 0.12f * std::tanh(12.0f * s) - 0.9f * s * s * s * s,
                height = 1.2f * (1.0f - std::abs(s)) - 0.2f * std::exp(-40.0f * s * s);
    return Vec3(radius * std::cos(angle), height, -radius * std::sin(angle));
  };
  scene::Primitive primitive =
      mesh_of(96, 64, bowl, add_material(capture, plain_material(Vec3(0.95f, 0.72f, 0.35f), 1.0f, 0.24f)));
  primitive.vertices.normals = normals_of(bowl, 96, 64);
  const int node = add_node(capture, primitive, {0, -0.6, 0});
  add_camera(capture, {0, 0.55, 4.2});
  add_motion(capture, node, {0.35, 0.12, 0.2});
  return capture;
}

Capture box_with_creases() {
  Capture capture;
  set_frame_size(capture);
  std::vector<Vec3> positions, normals;
  std::vector<std::uint32_t> indices;
  for (int face = 0; face < 6; ++face) {
    Vec3 normal(0.0f), a(0.0f), b(0.0f);
    normal[face / 2] = face % 2 == 0 ? 1.0f : -1.0f;
    a[(face / 2 + 1) % 3] = 1.0f, b[(face / 2 + 2) % 3] = 1.0f;
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (const auto& [s, t] : {std::pair{-1.0f, -1.0f}, {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}})
      positions.push_back(normal + s * a + t * b), normals.push_back(normal);
    indices.insert(indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
  }
  scene::Primitive box =
      triangles(positions, indices, add_material(capture, plain_material(Vec3(0.8f, 0.3f, 0.2f), 0.0f, 0.5f)));
  box.vertices.normals = normals;
  const int node = add_node(capture, box);
  capture.nodes[static_cast<std::size_t>(node)].transform.rotation = glm::normalize(DQuat(0.9, 0.25, 0.32, 0.05));
  add_camera(capture, {0, 0, 6});
  add_motion(capture, node, {1.2, 0.3, 0});  // 3 pixels a frame
  capture.settings.environment = 0.1f;
  capture.lights.emplace_back().color = Vec3(3.0f);
  capture.light_parameters.emplace_back().intensity = 3.0f;
  scene::Node sun;
  sun.light = 0;
  sun.transform.rotation = glm::normalize(DQuat(0.9, 0.1, -0.4, 0.0));
  capture.nodes.push_back(sun);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture;
}

Capture moving_torch() {
  Capture capture;
  set_frame_size(capture);
  const auto floor = [](float u, float v) { return Vec3(20.0f * u - 10.0f, 0.0f, 10.0f - 30.0f * v); };
  add_node(capture, mesh_of(16, 16, floor, add_material(capture, plain_material(Vec3(0.6f), 0.0f, 0.8f))));
  add_camera(capture, {0, 1.2, 5});
  shaders::Light light;
  light.type = shaders::Light::Type::kPoint;
  scene::LightParameters parameters;
  parameters.color = {1.0f, 0.6f, 0.2f}, parameters.intensity = 0.02f;
  parameters.apply(light);
  capture.lights.push_back(light), capture.light_parameters.push_back(parameters);
  scene::Node torch;
  torch.light = 0;
  torch.transform.translation = {-1, 0.3, 2};
  capture.nodes.push_back(torch);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  add_motion(capture, capture.roots.back(), {2, 0, -1});
  capture.settings.environment = 0.3f;
  return capture;
}

}  // namespace tessera::test
