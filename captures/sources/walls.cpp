#include <cmath>
#include <string>

#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

// Patches are squares with sides of kPatch; at 360 rows they are 60 pixels wide. The depth of all layers follows the
// same sine, whose length is kWave.
constexpr float kPatch = 1.0f, kWave = 6.0f, kSwing = 0.5f, kDistance = 10.0f, kRows = 6.0f;
constexpr int kAcross = 18, kUp = 8;

// One layer, facing +z. It is wider than the view by a wave, so that it covers the view at any phase.
Geometry layer() {
  return patches_of(
      [](float u, float v) {
        const float x = (u - 1.0f) * kPatch * kAcross + 6.0f, y = (v - 0.5f) * kPatch * kUp;
        return Vec3(x, y, kSwing * std::sin(2.0f * kPi * x / kWave));
      },
      kAcross, kUp, [](float u, float v) { return Vec3(0.75f + 0.25f * std::sin(11.0f * u + 7.0f * v)); });
}

float bumps(float u, float v) {
  return 0.5f + 0.5f * std::sin(2.0f * kPi * u * 3.0f) * std::sin(2.0f * kPi * v * 2.0f);
}

Image8 bump_normals() {
  return data_image(32, 32, [](float u, float v) {
    constexpr float kStep = 1.0f / 64.0f;
    const Vec3 n = glm::normalize(
        Vec3(bumps(u - kStep, v) - bumps(u + kStep, v), bumps(u, v - kStep) - bumps(u, v + kStep), 1.0f));
    return n * 0.5f + 0.5f;
  });
}

json wall_material(Asset& asset, const std::string& name, bool attributes) {
  const Vec2 repeat(kAcross, kUp);
  json material = {{"pbrMetallicRoughness",
                    {{"baseColorFactor", {0.7, 0.6, 0.5, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.6}}}};
  if (attributes) {
    const Image8 bricks = color_image(32, 32, [](float u, float v) {
      return mix(Vec3(0.45f, 0.30f, 0.25f), Vec3(0.85f, 0.75f, 0.65f), bumps(u, v));
    });
    material["pbrMetallicRoughness"]["baseColorTexture"] =
        texture_info(asset.add_color_texture(bricks, name + "_color"), repeat);
    material["normalTexture"] = texture_info(asset.add_data_texture(bump_normals(), name + "_normals"), repeat);
  }
  const int heights = asset.add_height_texture(height_image(32, 32, bumps), name + "_heights");
  return displaced(material, heights, repeat, 0.12f, -0.06f);
}

// The layers' common node rests in frame 0 and moves by 8 and 32 pixels of 360 rows while the shutter of frames 1 and 2 is open.
void add_motion(Asset& asset, int node) {
  constexpr float kFrame = 1.0f / 24.0f, kPixel = kRows / 360.0f;
  const Vec3 along = glm::normalize(Vec3(2.0f, 1.0f, 0.0f));
  std::vector<float> times;
  std::vector<Vec3> places;
  for (const float pixels : {0.0f, 8.0f, 32.0f})
    for (const float side : {-0.5f, 0.5f}) {
      times.push_back((static_cast<float>(times.size() / 2) + (side > 0.0f ? 0.5f : 0.0f)) * kFrame);
      places.push_back(along * (side * pixels * kPixel));
    }
  asset.animate(node, "translation", times, places);
}

}  // namespace

void make_wall(const std::filesystem::path& folder, int layers, bool attributes) {
  const std::string name = "wall_" + std::to_string(layers) + (attributes ? "" : "_plain");
  Asset asset(name);
  Geometry shape = layer();
  if (!attributes) shape.colors.clear();
  const int mesh = asset.add_mesh(shape, asset.add_material(wall_material(asset, name, attributes)));
  // Each layer begins at another phase: it is the nearest in its share of the view, and behind others elsewhere. No
  // two layers have their seams at the same places.
  std::vector<int> children;
  for (int k = 0; k < layers; ++k) {
    const float share = static_cast<float>(k) / static_cast<float>(layers),
                odd = std::fmod(0.618f * share * 16.0f, 1.0f);
    children.push_back(asset.add_node({{"mesh", mesh}, {"translation", {kWave * share + 0.13f, odd - 0.5f, 0.0f}}}));
  }
  add_motion(asset, asset.add_node({{"name", "wall"}, {"children", children}}));

  const int sun = asset.add_light({{"type", "directional"}, {"color", {1.0, 0.95, 0.86}}, {"intensity", 2.0}});
  json key = look_at({-3.0f, 4.5f, 5.0f}, {0, 0, 0});
  key["extensions"]["KHR_lights_punctual"]["light"] = sun;
  asset.add_node(key);
  json view = look_at({0.0f, 0.0f, kDistance}, {0, 0, 0});
  view["camera"] = asset.add_camera(
      {{"type", "perspective"},
       {"perspective", {{"yfov", 2.0f * std::atan(0.5f * kRows / kDistance)}, {"znear", 1.0}, {"zfar", 40.0}}}});
  asset.add_node(view);
  asset.capture_settings() = {{"resolution", {640, 360}},
                              {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},
                              {"frames", {{"first", 0}, {"count", 3}}},
                              {"environment", 0.5}};
  asset.write(folder);
}

}  // namespace tessera::captures
