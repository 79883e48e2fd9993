#include <cmath>

#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

// A rocket along +x: lathe, nose first.
Geometry rocket() {
  return revolve(smooth_profile(
      {{0.0f, -1.3f}, {0.20f, -1.28f}, {0.26f, -0.9f}, {0.36f, -0.2f}, {0.33f, 0.5f}, {0.18f, 1.1f}, {0.0f, 1.45f}},
      false, true));
}

Image8 livery() {
  return color_image(256, 256, [](float u, float v) {
    const Vec3 white(0.93f, 0.93f, 0.95f), red(0.82f, 0.10f, 0.08f), navy(0.06f, 0.09f, 0.22f);
    Vec3 color = v < 0.24f || (v > 0.80f && v < 0.86f) ? red : white;
    if (v > 0.36f && v < 0.47f) color = std::fmod(u * 12.0f + 0.02f, 1.0f) < 0.5f ? navy : white;
    if (std::hypot(std::fmod(u * 4.0f, 1.0f) / 4.0f - 0.125f, (v - 0.58f) * 0.6f) < 0.035f) color = navy;
    return color;
  });
}

Image8 facade() {
  return color_image(256, 256, [](float u, float v) {
    const float x = u * 6.0f - std::floor(u * 6.0f), y = v * 10.0f - std::floor(v * 10.0f);
    const bool window = x > 0.22f && x < 0.78f && y > 0.2f && y < 0.8f;
    const auto number = static_cast<std::uint32_t>(std::floor(u * 6.0f)) * 31u +
                        static_cast<std::uint32_t>(std::floor(v * 10.0f)) * 17u;
    if (!window) return Vec3(0.34f, 0.32f, 0.36f) * (0.85f + 0.3f * noise(u, v, 32, 2, 6));
    return number % 5u < 2u ? Vec3(0.98f, 0.82f, 0.48f) : Vec3(0.13f, 0.17f, 0.27f);
  });
}

// Markings along x, worn; the far edge, under the houses, is dark.
Image8 runway() {
  return color_image(512, 512, [](float u, float v) {
    Vec3 color = Vec3(0.25f, 0.26f, 0.29f) * (0.8f + 0.4f * noise(u, v, 40, 4, 3));
    const float dash = u * 20.0f - std::floor(u * 20.0f), worn = smooth_step(0.25f, 0.5f, noise(u, v, 64, 2, 12));
    const bool middle = std::abs(v - 0.28f) < 0.006f && dash < 0.6f,
               border = std::abs(v - 0.12f) < 0.005f || std::abs(v - 0.44f) < 0.005f;
    if (middle || border) color = mix(color, Vec3(0.92f, 0.90f, 0.82f), worn);
    return color * (1.0f - 0.75f * smooth_step(0.52f, 0.64f, v));
  });
}

}  // namespace

void make_flyby(const std::filesystem::path& folder) {
  Asset asset("flyby");
  const int paint =
      asset.add_material({{"doubleSided", true},
                          {"pbrMetallicRoughness",
                           {{"baseColorTexture", texture_info(asset.add_color_texture(livery(), "flyby_livery"))},
                            {"metallicFactor", 0.1},
                            {"roughnessFactor", 0.3}}}});
  const int fin_material = asset.add_material(
      {{"doubleSided", true},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.80, 0.08, 0.06, 1.0}}, {"metallicFactor", 0.1}, {"roughnessFactor", 0.35}}}});
  const int rocket_mesh = asset.add_mesh(rocket(), paint);
  const int fin_mesh = asset.add_mesh(box({0.02f, 0.32f, 0.24f}), fin_material);

  // Three rockets at three speeds; the nearest crosses the whole screen while the shutter is open.
  struct Flight {
    float from_x, speed, y, z, size, roll;  // units per second
  };
  const Flight flights[] = {{-5.0f, 460.0f, 1.55f, 0.9f, 1.0f, 9.0f},
                            {-3.3f, 190.0f, 3.05f, -2.2f, 0.9f, 5.0f},
                            {0.6f, 55.0f, 1.35f, -3.8f, 1.0f, 3.0f}};
  for (const Flight& f : flights) {
    const glm::quat along = glm::angleAxis(-kPi / 2, Vec3(0, 0, 1));
    std::vector<int> parts = {asset.add_node({{"mesh", rocket_mesh}})};
    for (int k = 0; k < 3; ++k) {
      const float a = 2.0f * kPi * static_cast<float>(k) / 3.0f;
      const glm::quat turn = glm::angleAxis(a, Vec3(0, 1, 0));
      const Vec3 at = turn * Vec3(0, -1.15f, 0.38f);
      parts.push_back(
          asset.add_node({{"mesh", fin_mesh}, {"translation", array_of(at)}, {"rotation", array_of(turn)}}));
    }
    const int node = asset.add_node({{"name", "rocket"}, {"children", parts}, {"scale", {f.size, f.size, f.size}}});
    std::vector<float> times = {0.0f, 1.0f / 24.0f};
    std::vector<Vec3> places = {{f.from_x, f.y, f.z}, {f.from_x + f.speed / 24.0f, f.y, f.z}};
    std::vector<glm::quat> turns = {along, along * glm::angleAxis(f.roll / 24.0f, Vec3(0, 1, 0))};
    asset.animate(node, "translation", times, places);
    asset.animate(node, "rotation", times, turns);
  }

  const int wall =
      asset.add_material({{"pbrMetallicRoughness",
                           {{"baseColorTexture", texture_info(asset.add_color_texture(facade(), "flyby_facade"))},
                            {"metallicFactor", 0.0},
                            {"roughnessFactor", 0.7}}}});
  for (int k = 0; k < 11; ++k) {
    const float x = -10.0f + 2.0f * static_cast<float>(k),
                height = 1.1f + 0.9f * std::abs(std::sin(2.1f * static_cast<float>(k) + 0.4f));
    asset.add_node({{"mesh", asset.add_mesh(box({0.72f, height, 0.72f}), wall)},
                    {"translation", {x, height, -6.5f - 0.8f * static_cast<float>(k % 3)}},
                    {"rotation", array_of(glm::angleAxis(0.35f * static_cast<float>(k), Vec3(0, 1, 0)))}});
  }
  const int tarmac =
      asset.add_material({{"pbrMetallicRoughness",
                           {{"baseColorTexture", texture_info(asset.add_color_texture(runway(), "flyby_runway"))},
                            {"metallicFactor", 0.0},
                            {"roughnessFactor", 0.55}}}});
  asset.add_node({{"mesh", asset.add_mesh(ground({-20, -8}, {20, 16}, 20, 12), tarmac)}});

  const int sun = asset.add_light({{"type", "directional"}, {"color", {1.0, 0.80, 0.62}}, {"intensity", 3.0}});
  json key = look_at({5.0f, 3.0f, 4.0f}, {0, 0, 0});
  key["extensions"]["KHR_lights_punctual"]["light"] = sun;
  asset.add_node(key);
  json view = look_at({0.0f, 2.3f, 8.2f}, {0.0f, 2.0f, 0.0f});
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.70}, {"znear", 0.2}, {"zfar", 80.0}}}});
  asset.add_node(view);
  asset.capture_settings() = {{"resolution", {1280, 720}},
                              {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},
                              {"environment", 0.7},
                              {"background", {0.34, 0.30, 0.42}}};
  asset.write(folder);
}

}  // namespace tessera::captures
