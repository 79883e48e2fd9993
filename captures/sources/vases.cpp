#include <cmath>

#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

json plain(Vec3 color, float metallic, float roughness) {
  return {{"pbrMetallicRoughness",
           {{"baseColorFactor", {color.x, color.y, color.z, 1.0}},
            {"metallicFactor", metallic},
            {"roughnessFactor", roughness}}}};
}

// Painted bands with a meander between them.
Image8 glaze() {
  return color_image(512, 512, [](float u, float v) {
    const Vec3 clay(0.72f, 0.36f, 0.20f), ink(0.10f, 0.07f, 0.06f);
    const float band = std::abs(v - 0.42f);
    bool dark = (band > 0.10f && band < 0.115f) || (band > 0.125f && band < 0.13f) || v < 0.12f || v > 0.9f;
    if (band < 0.085f) {
      // A Greek key on a 7 x 7 grid.
      static constexpr const char* kKey[7] = {"#######", "#......", "#.####.", "#.#..#.",
                                              "#.##.#.", "#....#.", "######."};
      const int x = static_cast<int>(u * 24.0f * 7.0f) % 7, y = static_cast<int>((v - 0.335f) / 0.17f * 7.0f);
      dark = kKey[std::min(std::max(y, 0), 6)][x] == '#';
    }
    const float rays = v > 0.66f ? std::abs(std::fmod(u * 32.0f, 1.0f) - 0.5f) * 2.0f - (v - 0.66f) * 4.2f : 1.0f;
    if (rays < 0.0f) dark = true;
    return (dark ? ink : clay) * (0.88f + 0.24f * noise(u, v, 24, 3, 3));
  });
}

Image8 planks() {
  return color_image(512, 512, [](float u, float v) {
    const float across = v * 6.0f;
    const auto plank = static_cast<std::uint32_t>(across);
    const float seam =
        smooth_step(0.0f, 0.02f, across - std::floor(across)) * smooth_step(1.0f, 0.98f, across - std::floor(across));
    const float grain = noise(u, v * 8.0f - std::floor(v * 8.0f), 3, 2, 50 + plank), fine = noise(u, v, 64, 2, 91);
    const Vec3 wood = mix(Vec3(0.36f, 0.22f, 0.13f), Vec3(0.58f, 0.39f, 0.24f), 0.55f * grain + 0.45f * fine);
    return wood * (0.35f + 0.65f * seam) * (0.85f + 0.1f * static_cast<float>(plank % 3u));
  });
}

// Adds a table with objects on it, and the sun.
void add_table(Asset& asset) {
  const auto add = [&](const Geometry& g, json material, Vec3 at, float size, float turn = 0) {
    const glm::quat rotation = glm::angleAxis(turn, Vec3(0, 1, 0));
    asset.add_node({{"mesh", asset.add_mesh(g, asset.add_material(std::move(material)))},
                    {"translation", array_of(at)},
                    {"rotation", array_of(rotation)},
                    {"scale", {size, size, size}}});
  };
  json table = plain(Vec3(1.0f), 0.0f, 0.45f);
  table["pbrMetallicRoughness"]["baseColorTexture"] =
      texture_info(asset.add_color_texture(planks(), "vases_planks"), Vec2(2, 1));
  const Vec2 low(-5, -3.2f), high(5, 3.6f);
  const std::vector<Blob> blobs = {{{-0.15f, -0.1f}, 0.48f}, {{-2.0f, -0.35f}, 0.6f},  {{1.75f, 0.25f}, 0.6f},
                                   {{0.95f, -1.35f}, 0.24f}, {{-0.95f, -1.55f}, 0.5f}, {{2.55f, -0.95f}, 0.55f}};
  table["occlusionTexture"] = texture_info(asset.add_data_texture(contact_shade(blobs, low, high), "vases_shade"));
  add(ground(low, high, 10, 7), table, {0, 0, 0}, 1.0f);

  json painted = plain(Vec3(1.0f), 0.0f, 0.32f);
  painted["pbrMetallicRoughness"]["baseColorTexture"] = texture_info(asset.add_color_texture(glaze(), "vases_glaze"));
  painted["doubleSided"] = true;
  add(revolve(smooth_profile({{0.0f, 0.0f},
                              {0.34f, 0.02f},
                              {0.26f, 0.12f},
                              {0.66f, 0.75f},
                              {0.55f, 1.30f},
                              {0.20f, 1.62f},
                              {0.19f, 1.85f},
                              {0.34f, 1.98f}},
                             false, false)),
      painted, {-0.15f, 0, 0.1f}, 1.25f, 0.4f);
  json bronze = plain({0.86f, 0.58f, 0.30f}, 1.0f, 0.26f);
  bronze["doubleSided"] = true;
  add(revolve(
          smooth_profile({{0.0f, 0.0f}, {0.42f, 0.03f}, {0.52f, 0.20f}, {0.30f, 0.55f}, {0.42f, 0.95f}, {0.62f, 1.08f}},
                         false, false)),
      bronze, {-2.0f, 0, 0.35f}, 1.1f);
  json jade = plain({0.07f, 0.32f, 0.20f}, 0.0f, 0.18f);
  jade["doubleSided"] = true;
  add(revolve(smooth_profile(
          {{0.0f, 0.0f}, {0.30f, 0.0f}, {0.62f, 0.34f}, {0.50f, 0.72f}, {0.13f, 0.98f}, {0.11f, 1.45f}, {0.22f, 1.62f}},
          false, false)),
      jade, {1.75f, 0, -0.25f}, 1.2f);

  // Triangle meshes beside the patches: a pearl, a ring and a block.
  const float two_pi = 6.2831853f;
  const Geometry pearl = mesh_of(
      [&](float u, float v) {
        const float a = u * two_pi, b = (v - 0.5f) * two_pi * 0.5f;
        return Vec3(std::cos(a) * std::cos(b), std::sin(b), -std::sin(a) * std::cos(b));
      },
      48, 24);
  add(pearl, plain({0.93f, 0.89f, 0.84f}, 0.0f, 0.12f), {0.95f, 0.26f, 1.35f}, 0.26f);
  const Geometry ring = mesh_of(
      [&](float u, float v) {
        const float a = u * two_pi, b = v * two_pi, r = 1.0f + 0.3f * std::cos(b);
        return Vec3(std::cos(a) * r, 0.3f * std::sin(b), -std::sin(a) * r);
      },
      64, 24);
  add(ring, plain({1.0f, 0.80f, 0.38f}, 1.0f, 0.22f), {-0.95f, 0.125f, 1.55f}, 0.40f);
  add(box({0.5f, 0.22f, 0.34f}), plain({0.30f, 0.02f, 0.03f}, 0.0f, 0.5f), {2.55f, 0.22f, 0.95f}, 1.0f, 0.5f);

  const int sun = asset.add_light({{"type", "directional"}, {"color", {1.0, 0.95, 0.86}}, {"intensity", 2.2}});
  json key = look_at({-3.0f, 4.5f, 3.5f}, {0, 0, 0});
  key["extensions"]["KHR_lights_punctual"]["light"] = sun;
  asset.add_node(key);
}

json camera_at(Vec3 eye, Vec3 target, Asset& asset) {
  json view = look_at(eye, target);
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.62}, {"znear", 0.2}, {"zfar", 50.0}}}});
  return view;
}

}  // namespace

void make_vases(const std::filesystem::path& folder) {
  Asset asset("vases");
  add_table(asset);
  asset.add_node(camera_at({0.35f, 2.1f, 6.4f}, {0.1f, 0.95f, 0.0f}, asset));
  asset.capture_settings() = {{"resolution", {1280, 720}}, {"environment", 0.75}};
  asset.write(folder);
}

void make_stroll(const std::filesystem::path& folder) {
  Asset asset("stroll");
  add_table(asset);
  const int camera = asset.add_node(camera_at({-1.1f, 2.2f, 6.3f}, {0.0f, 0.9f, 0.0f}, asset));
  // Along an arc around the table: slowly, then faster and faster, then to a halt. Two seconds at 30 frames.
  std::vector<float> times;
  std::vector<Vec3> places;
  std::vector<glm::quat> turns;
  for (int k = 0; k <= 60; ++k) {
    const float t = static_cast<float>(k) / 30.0f, s = 0.06f * t + 0.94f * smooth_step(0.9f, 1.9f, t);
    const float angle = -0.17f + 0.42f * s;
    const Vec3 eye(std::sin(angle) * 6.4f, 2.2f - 0.25f * s, std::cos(angle) * 6.4f);
    const json view = look_at(eye, {0.0f, 0.9f, 0.0f});
    times.push_back(t);
    places.push_back(eye);
    const std::vector<float> q = view["rotation"].get<std::vector<float>>();
    turns.emplace_back(q[3], q[0], q[1], q[2]);
  }
  asset.animate(camera, "translation", times, places);
  asset.animate(camera, "rotation", times, turns);
  asset.capture_settings() = {
      {"resolution", {1280, 720}}, {"frameRate", 30}, {"frames", {{"first", 0}, {"count", 60}}}, {"environment", 0.75}};
  asset.write(folder);
}

}  // namespace tessera::captures
