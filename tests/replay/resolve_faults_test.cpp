// Scenes that desampling once got wrong, against full shading as a display shows it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "replay/statistics.h"
#include "tests/replay/desampled_comparison.h"

namespace tessera::replay {
namespace {

using scene::AnimatedPath;
using scene::Capture;

constexpr int kWidth = Comparison::kWidth, kHeight = Comparison::kHeight;

// ---- Surfaces ---------------------------------------------------------------------------------------------------

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
  return test::triangles(std::move(positions), std::move(indices), material);
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

void set_frame_size(Capture& capture) { capture.settings.width = kWidth, capture.settings.height = kHeight; }

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

// ---- What is still ----------------------------------------------------------------------------------------------

// A wall whose normals turn while its vertices stay where they are.
Capture turning_normals() {
  Capture capture;
  set_frame_size(capture);
  const auto wall = [](float u, float v) { return Vec3(8.0f * u - 4.0f, 4.5f * v - 2.25f, 0.0f); };
  scene::Primitive primitive =
      mesh_of(16, 9, wall, test::add_material(capture, plain_material(Vec3(0.9f, 0.7f, 0.4f), 1.0f, 0.3f)));
  scene::MorphTarget target;
  for (const Vec3& p : primitive.vertices.positions) {
    primitive.vertices.normals.push_back({0.0f, 0.0f, 1.0f});
    target.normals.push_back({0.8f * std::sin(p.x), 0.8f * std::cos(2.0f * p.y), 0.0f});
  }
  primitive.vertices.morph_targets.push_back(target);
  const int node = test::add_node(capture, primitive);
  test::add_camera(capture, {0, 0, 5});
  scene::AnimationChannel weights = channel_of(AnimatedPath::kWeights, 1, {0.0f, 1.0f}, {0.0f, 3.0f});
  weights.node = node;
  add_channel(capture, weights);
  return capture;
}

TEST(ResolveFaults, NormalsThatMorphAreShadedAnew) {  // MF3
  const Comparison c(turning_normals(), 3, 8);
  EXPECT_GE(c.worst_psnr(0), 50);
  EXPECT_EQ(c.back().counters.pixels_advected, 0u);
}

// One of two walls changes its colour: the other goes on as it was.
TEST(ResolveFaults, MaterialsThatChangeAreShadedAnewAndTheirNeighboursAreNot) {  // MF3
  Capture capture;
  set_frame_size(capture);
  for (const float x : {-4.0f, 0.0f})
    test::add_node(capture, mesh_of(
                                4, 4, [&](float u, float v) { return Vec3(x + 4.0f * u, 5.0f * v - 2.5f, 0.0f); },
                                test::add_material(capture, plain_material(Vec3(0.5f), 0.0f, 0.6f))));
  test::add_camera(capture, {0, 0, 5});
  scene::AnimationChannel color =
      channel_of(AnimatedPath::kBaseColor, 4, {0.0f, 1.0f}, {0.5f, 0.5f, 0.5f, 1, 0.9f, 0.1f, 0.1f, 1});
  color.object = 1;
  add_channel(capture, color);
  const Comparison c(capture, 3, 8);
  EXPECT_GE(c.worst_psnr(0), 50);
  const double share = static_cast<double>(c.back().counters.pixels_advected) / (kWidth * kHeight);
  EXPECT_GT(share, 0.2);
  EXPECT_LT(share, 0.3);
}

// ---- Cuts and what stops ----------------------------------------------------------------------------------------

// The camera of `stroll` jumps at the middle of its walk.
Capture with_a_cut() {
  Capture capture = scene::read_capture(test::shipped_capture("stroll"));
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

TEST(ResolveFaults, ACutIsShadedFullyAndSoIsWhatFollows) {  // RU7
  const Capture capture = with_a_cut();
  const Comparison c(capture, 27, 33);
  EXPECT_GE(c.worst_psnr(0), 50);
  // The failing twin: what is fast may be coarse although nobody has followed it.
  EXPECT_LT(Comparison(capture, 27, 33, {"resolve.k_cut=0"}).worst_psnr(0), 40);
}

// A textured board crosses the frame at 12 pixels a frame, and stands still from one frame to the next.
TEST(ResolveFaults, WhatStopsIsNotWhatWasReconstructedBefore) {  // RU7
  Capture capture;
  set_frame_size(capture);
  scene::Material material = plain_material(Vec3(1.0f), 0.0f, 0.7f);
  Image8 grain(64, 64, 3);
  test::Random random(7);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (std::size_t k = 0; k < 3; ++k) grain.at(x, y)[k] = static_cast<std::uint8_t>(random.integer(80, 220));
  material.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{grain}, shaders::ColorSpace::kSrgb);
  scene::Primitive board = mesh_of(
      1, 1, [](float u, float v) { return Vec3(4.0f * u - 2.0f, 4.0f * v - 2.0f, 0.0f); },
      test::add_material(capture, material));
  board.vertices.texcoords = {{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  const int node = test::add_node(capture, board);
  test::add_camera(capture, {0, 0, 6});
  scene::AnimationChannel way =
      channel_of(AnimatedPath::kTranslation, 3, {0.0f, 10.0f / 30.0f, 2.0f}, {-1.5f, 0, 0, 0.5f, 0, 0, 0.5f, 0, 0});
  way.node = node;
  add_channel(capture, way);
  const Comparison c(capture, 6, 15);
  EXPECT_GT(c.frames[3].counters.blocks_rate_4, 500u);
  EXPECT_GE(c.worst_psnr(5), 50);
  EXPECT_GT(c.back().saved, 0.4);
}

// Two rockets of `flyby` come across half of the frame and are sharp in the next one: what is not blurred shows its
// pattern, however far it came.
TEST(ResolveFaults, WhatIsSharpIsNotCoarseHoweverFarItCame) {
  const Comparison c(scene::read_capture(test::shipped_capture("flyby")), 0, 6);
  EXPECT_GE(c.worst_psnr(0), 50);
  EXPECT_GE(c.saved(1), 0.30);
}

// ---- One surface before itself, and creases ---------------------------------------------------------------------

// A bowl of brass whose lip hides its inside, slowly turned.
TEST(ResolveFaults, WhatASurfaceUncoversOfItselfIsNotWhatHidIt) {  // ADV4
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
      mesh_of(96, 64, bowl, test::add_material(capture, plain_material(Vec3(0.95f, 0.72f, 0.35f), 1.0f, 0.24f)));
  primitive.vertices.normals = normals_of(bowl, 96, 64);
  const int node = test::add_node(capture, primitive, {0, -0.6, 0});
  test::add_camera(capture, {0, 0.55, 4.2});
  test::add_motion(capture, node, {0.35, 0.12, 0.2});
  const Comparison c(capture, 3, 12);
  EXPECT_GT(c.saved(1), 0.25);
  double worst = 0;
  for (const Comparison::Frame& frame : c.frames) worst = std::max(worst, max_difference(frame.shown, frame.expected));
  EXPECT_LE(worst, 0.05);
}

// A box whose faces a light tells apart, crossing the frame at rates that reconstruct.
TEST(ResolveFaults, CreasesAreEdges) {
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
  scene::Primitive box = test::triangles(
      positions, indices, test::add_material(capture, plain_material(Vec3(0.8f, 0.3f, 0.2f), 0.0f, 0.5f)));
  box.vertices.normals = normals;
  const int node = test::add_node(capture, box);
  capture.nodes[static_cast<std::size_t>(node)].transform.rotation = glm::normalize(DQuat(0.9, 0.25, 0.32, 0.05));
  test::add_camera(capture, {0, 0, 6});
  test::add_motion(capture, node, {1.2, 0.3, 0});  // 3 pixels a frame
  capture.settings.environment = 0.1f;
  capture.lights.emplace_back().color = Vec3(3.0f);
  capture.light_parameters.emplace_back().intensity = 3.0f;
  scene::Node sun;
  sun.light = 0;
  sun.transform.rotation = glm::normalize(DQuat(0.9, 0.1, -0.4, 0.0));
  capture.nodes.push_back(sun);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  const IntRect crop{208, 88, 432, 272};
  const Comparison c(capture, 3, 8, {}, crop);
  EXPECT_GE(c.worst_psnr(0), 53);
  EXPECT_GT(c.back().counters.blocks_creased, 50u);
  EXPECT_GT(c.saved(1), 0.2);
  EXPECT_LT(Comparison(capture, 3, 8, {"resolve.edge_angle=0"}, crop).worst_psnr(0), 53);  // the failing twin
}

// ---- Lights -----------------------------------------------------------------------------------------------------

TEST(ResolveFaults, ALightThatMovesIsShadedWhereItReaches) {  // LR1
  Capture capture;
  set_frame_size(capture);
  const auto floor = [](float u, float v) { return Vec3(20.0f * u - 10.0f, 0.0f, 10.0f - 30.0f * v); };
  test::add_node(capture, mesh_of(16, 16, floor, test::add_material(capture, plain_material(Vec3(0.6f), 0.0f, 0.8f))));
  test::add_camera(capture, {0, 1.2, 5});
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
  test::add_motion(capture, capture.roots.back(), {2, 0, -1});
  capture.settings.environment = 0.3f;
  const Comparison c(capture, 3, 9);
  EXPECT_GE(c.saved(1), 0.40);
  EXPECT_GE(c.worst_psnr(1), 42);
  EXPECT_EQ(c.back().advection, "blocks slower than resolve.k_stat, out of reach of the lights that changed");
  EXPECT_GT(c.back().counters.light_tests, 0u);
}

}  // namespace
}  // namespace tessera::replay
