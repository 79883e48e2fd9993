#include <cmath>

#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

constexpr float kLength = 6.0f;
constexpr int kJoints = 14;

float radius_at(float s) {  // s from the snout to the tail
  const float head = 0.20f + 0.16f * smooth_step(0.0f, 0.05f, s) - 0.05f * smooth_step(0.07f, 0.14f, s);
  return head * (s < 0.012f ? smooth_step(-0.004f, 0.012f, s) : 1.0f) * (1.0f - 0.9f * smooth_step(0.35f, 1.0f, s)) +
         0.004f;
}

// A tube along -x, slightly flattened, with a fin along its back.
Geometry body() {
  Geometry g = mesh_of(
      [](float u, float v) {
        const float s = std::min(std::max(v, 0.0f), 1.0f), a = u * 2.0f * kPi, r = radius_at(s);
        const float fin = 1.0f + 1.1f * smooth_step(0.94f, 1.0f, std::cos(a)) * smooth_step(0.12f, 0.3f, s) *
                                     smooth_step(1.0f, 0.7f, s);
        return Vec3(-s * kLength, std::cos(a) * r * fin, std::sin(a) * r * 0.85f);
      },
      40, 120);
  for (const Vec3& p : g.positions) {
    const float along = -p.x / kLength * (kJoints - 1);
    const int first = std::min(static_cast<int>(along), kJoints - 2);
    const float weight = smooth_step(0.0f, 1.0f, along - static_cast<float>(first));
    g.joints.push_back({static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(first + 1), 0, 0});
    g.weights.emplace_back(1.0f - weight, weight, 0.0f, 0.0f);
  }
  return g;
}

Image8 skin_colors() {
  return color_image(256, 512, [](float u, float v) {
    const float back = 0.5f + 0.5f * std::cos(u * 2.0f * kPi);
    const float wave = std::sin(v * 90.0f + 2.0f * noise(u, v, 8, 2, 4)) * 0.5f + 0.5f;
    const Vec3 belly(0.93f, 0.88f, 0.70f), green(0.06f, 0.38f, 0.34f), gold(0.93f, 0.66f, 0.16f);
    Vec3 color = mix(belly, mix(green, gold, smooth_step(0.62f, 0.75f, wave)), smooth_step(0.12f, 0.34f, back));
    // Eyes.
    const float du = std::min(std::abs(u - 0.17f), std::abs(u - 0.83f)),
                eye = std::hypot(du * 1.6f, (v - 0.048f) * 6.0f);
    if (eye < 0.085f) color = eye < 0.045f ? Vec3(0.02f) : Vec3(0.97f, 0.93f, 0.62f);
    return color * (0.8f + 0.3f * noise(u, v, 48, 2, 8));
  });
}

Image8 sand() {
  return color_image(256, 256, [](float u, float v) {
    const float ripple = std::sin((v * 26.0f + 0.9f * noise(u, v, 5, 3, 2)) * 2.0f * kPi) * 0.5f + 0.5f;
    return mix(Vec3(0.60f, 0.52f, 0.38f), Vec3(0.82f, 0.74f, 0.56f), 0.55f * ripple + 0.45f * noise(u, v, 64, 2, 77));
  });
}

}  // namespace

void make_serpent(const std::filesystem::path& folder) {
  Asset asset("serpent");
  const int skin_material =
      asset.add_material({{"pbrMetallicRoughness",
                           {{"baseColorTexture", texture_info(asset.add_color_texture(skin_colors(), "serpent_skin"))},
                            {"metallicFactor", 0.0},
                            {"roughnessFactor", 0.34}}}});
  // Joints in a chain from the head; each a step along -x from the one before.
  const float step = kLength / (kJoints - 1);
  std::vector<int> joints;
  std::vector<Mat4> inverse_bind;
  for (int j = 0; j < kJoints; ++j) {
    json node = {{"name", "joint " + std::to_string(j)}};
    if (j > 0) node["translation"] = {-step, 0.0, 0.0};
    joints.push_back(asset.add_node(node));
    if (j > 0) asset.node(joints[static_cast<std::size_t>(j) - 1])["children"] = {joints.back()};
    Mat4 inverse(1.0f);
    inverse[3] = Vec4(static_cast<float>(j) * step, 0, 0, 1);
    inverse_bind.push_back(inverse);
  }
  const int skin = asset.add_skin(joints, inverse_bind);
  asset.add_node({{"name", "serpent"}, {"mesh", asset.add_mesh(body(), skin_material)}, {"skin", skin}});

  // A wave runs down the body while it swims along +x.
  std::vector<float> times;
  for (int k = 0; k <= 48; ++k) times.push_back(static_cast<float>(k) / 24.0f);
  for (int j = 0; j < kJoints; ++j) {
    std::vector<glm::quat> bends;
    std::vector<Vec3> places;
    for (const float t : times) {
      const float phase = 2.0f * kPi * (1.1f * t - 0.105f * static_cast<float>(j));
      const float swing = (j == 0 ? 0.30f : 0.10f + 0.028f * static_cast<float>(j)) * std::sin(phase);
      const float rise = 0.07f * std::sin(phase * 0.5f + 0.6f);
      bends.push_back(glm::angleAxis(swing, Vec3(0, 1, 0)) * glm::angleAxis(rise, Vec3(0, 0, 1)));
      places.emplace_back(1.6f + 1.1f * t, 0.95f + 0.12f * std::sin(2.0f * kPi * 0.5f * t), 0.9f - 0.3f * t);
    }
    asset.animate(joints[static_cast<std::size_t>(j)], "rotation", times, bends);
    if (j == 0) asset.animate(joints[0], "translation", times, places);
  }

  const int sand_material = asset.add_material(
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", texture_info(asset.add_color_texture(sand(), "serpent_sand"), Vec2(4, 3))},
         {"metallicFactor", 0.0},
         {"roughnessFactor", 0.9}}}});
  asset.add_node({{"mesh", asset.add_mesh(mesh_of(
                                              [](float u, float v) {
                                                const float x = (u - 0.5f) * 22.0f, z = (0.45f - v) * 16.0f;
                                                return Vec3(x, 0.35f * (noise(u, v, 6, 3, 15) - 0.5f), z);
                                              },
                                              72, 56),
                                          sand_material)}});
  // Corals: bent tubes.
  const int coral = asset.add_material(
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.85, 0.28, 0.24, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.6}}}});
  const Geometry branch = mesh_of(
      [](float u, float v) {
        const float a = u * 2.0f * kPi, r = 0.12f * (1.0f - 0.65f * v) + 0.015f * std::sin(v * 40.0f);
        return Vec3(std::cos(a) * r + 0.35f * v * v, v * 1.5f, -std::sin(a) * r);
      },
      16, 24);
  const int branch_mesh = asset.add_mesh(branch, coral);
  for (int k = 0; k < 9; ++k) {
    const float angle = 0.9f * static_cast<float>(k);
    const Vec3 at = k < 5 ? Vec3(-2.6f, -0.32f, -1.6f) : Vec3(3.4f, -0.30f, -2.4f);
    const glm::quat turn = glm::angleAxis(angle, Vec3(0, 1, 0)) * glm::angleAxis(-0.30f, Vec3(0, 0, 1));
    const float size = 0.75f + 0.09f * static_cast<float>(k % 5);
    asset.add_node({{"mesh", branch_mesh},
                    {"translation", array_of(at)},
                    {"rotation", array_of(turn)},
                    {"scale", {size, size, size}}});
  }

  const int sun = asset.add_light({{"type", "directional"}, {"color", {0.80, 0.95, 1.0}}, {"intensity", 3.0}});
  json key = look_at({-2.0f, 6.0f, 2.5f}, {0, 0, 0});
  key["extensions"]["KHR_lights_punctual"]["light"] = sun;
  asset.add_node(key);
  json view = look_at({0.6f, 2.5f, 6.6f}, {0.0f, 0.65f, 0.0f});
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.66}, {"znear", 0.2}, {"zfar", 60.0}}}});
  asset.add_node(view);
  asset.capture_settings() = {{"resolution", {1280, 720}}, {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},     {"frames", {{"first", 12}, {"count", 1}}},
                              {"environment", 0.6},        {"background", {0.055, 0.17, 0.23}}};
  asset.write(folder);
}

}  // namespace tessera::captures
