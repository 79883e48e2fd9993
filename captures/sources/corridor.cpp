#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "captures/sources/asset.h"
#include "captures/sources/outdoors.h"
#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

// The corridor runs from z = kNearEnd to z = kFarEnd between walls at x = -kHalfWidth and kHalfWidth. Every bay has
// two tubes below the ceiling and two on the walls, each with two lights of short range: 8 x 16 = 128.
constexpr float kHalfWidth = 2.0f, kCeiling = 3.0f, kBay = 2.0f, kNearEnd = 2.0f, kFarEnd = -30.0f;
constexpr int kBays = 16;

struct Neon {
  Vec3 color;
  int light, mesh;
};

json material_of(Vec3 color, float metallic, float roughness) {
  return {{"pbrMetallicRoughness",
           {{"baseColorFactor", {color.x, color.y, color.z, 1.0}},
            {"metallicFactor", metallic},
            {"roughnessFactor", roughness}}}};
}

// Two cast panels over each other with bevelled edges, a bolt in each corner.
float panel_height(float u, float v) {
  const float y = std::fmod(2.0f * v, 1.0f), edge = std::min({u, 1.0f - u, y, 1.0f - y});
  const float plate = 0.55f * smooth_step(0.03f, 0.07f, edge) + 0.25f * smooth_step(0.16f, 0.20f, edge);
  const float bolt = glm::length(Vec2(std::min(u, 1.0f - u), std::min(y, 1.0f - y)) - Vec2(0.115f));
  return plate + 0.2f * (1.0f - smooth_step(0.015f, 0.045f, bolt));
}

Image8 panel_colors() {
  return color_image(64, 64, [](float u, float v) {
    const float worn = 0.85f + 0.15f * noise(u, v, 6, 3, 21);
    return mix(Vec3(0.30f, 0.31f, 0.33f), Vec3(0.66f, 0.66f, 0.64f), panel_height(u, v)) * worn;
  });
}

// Four square slabs with joints.
Image8 slab_colors() {
  return color_image(64, 64, [](float u, float v) {
    const float x = std::fmod(2.0f * u, 1.0f), y = std::fmod(2.0f * v, 1.0f);
    const float edge = std::min({x, 1.0f - x, y, 1.0f - y}), joint = smooth_step(0.01f, 0.035f, edge);
    const bool light = (u < 0.5f) == (v < 0.5f);
    return mix(Vec3(0.10f), light ? Vec3(0.34f, 0.33f, 0.34f) : Vec3(0.22f, 0.22f, 0.24f), joint);
  });
}

// The rectangle at `at` along `u` and `v`, of nu x nv bilinear patches; its front faces along u x v.
void add_rectangle(Geometry& g, Vec3 at, Vec3 u, Vec3 v, int nu, int nv) {
  const auto corner = [&](int i, int j) {
    const Vec2 s(static_cast<float>(i) / static_cast<float>(nu), static_cast<float>(j) / static_cast<float>(nv));
    return Corner{at + u * s.x + v * s.y, {s.x * glm::length(u) / kBay, s.y * glm::length(v) / kBay}};
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) add_patch(g, {corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)});
  g.colors.clear();
}

void add_shell(Asset& asset) {
  const Vec3 along(0, 0, kFarEnd - kNearEnd), up(0, kCeiling, 0), across(2 * kHalfWidth, 0, 0);
  json wall = material_of(Vec3(0.8f), 0.0f, 0.5f), floor = material_of(Vec3(1.0f), 0.0f, 0.16f);
  wall["pbrMetallicRoughness"]["baseColorTexture"] =
      texture_info(asset.add_color_texture(panel_colors(), "corridor_panels"), Vec2(1.0f));
  floor["pbrMetallicRoughness"]["baseColorTexture"] =
      texture_info(asset.add_color_texture(slab_colors(), "corridor_slabs"), Vec2(1.0f));
  const int heights = asset.add_height_texture(height_image(64, 64, panel_height), "corridor_heights");
  Geometry walls, slabs, ceiling;
  add_rectangle(walls, {-kHalfWidth, 0, kNearEnd}, along, up, kBays, 2);
  add_rectangle(walls, {kHalfWidth, 0, kFarEnd}, -along, up, kBays, 2);
  add_rectangle(walls, {-kHalfWidth, 0, kFarEnd}, across, up, 2, 2);
  // v of the walls' texture runs down from the ceiling.
  for (Vec2& t : walls.texcoords) t.y = 1.0f - t.y;
  add_rectangle(slabs, {-kHalfWidth, 0, kNearEnd}, across, along, 2, kBays);
  add_rectangle(ceiling, {kHalfWidth, kCeiling, kNearEnd}, -across, along, 1, kBays);
  asset.add_node({{"name", "walls"},
                  {"mesh", asset.add_mesh(walls, asset.add_material(displaced(wall, heights, Vec2(1), 0.09f, 0)))}});
  asset.add_node({{"name", "floor"}, {"mesh", asset.add_mesh(slabs, asset.add_material(floor))}});
  const int plaster = asset.add_material(material_of(Vec3(0.30f, 0.31f, 0.33f), 0.0f, 0.7f)),
            steel = asset.add_material(material_of(Vec3(0.35f, 0.36f, 0.38f), 0.9f, 0.35f));
  asset.add_node({{"name", "ceiling"}, {"mesh", asset.add_mesh(ceiling, plaster)}});
  Geometry beams;
  for (int bay = 0; bay <= kBays; ++bay) {
    const float z = kNearEnd - kBay * static_cast<float>(bay);
    add_box(beams, {-kHalfWidth, kCeiling - 0.16f, z - 0.09f}, {kHalfWidth, kCeiling, z + 0.09f}, 4u | 16u | 32u, 1.0f);
    for (const float side : {-1.0f, 1.0f}) {
      const float outer = side * kHalfWidth, inner = side * (kHalfWidth - 0.16f);
      add_box(beams, {std::min(outer, inner), 0, z - 0.09f}, {std::max(outer, inner), kCeiling - 0.16f, z + 0.09f},
              (side < 0 ? 2u : 1u) | 16u | 32u, 1.0f);
    }
  }
  beams.colors.clear();
  asset.add_node({{"name", "beams"}, {"mesh", asset.add_mesh(beams, steel)}});
}

// A tube one metre long about +y, with its ends rounded.
Geometry tube() {
  return revolve(smooth_profile(
      {{0.0f, -0.5f}, {0.03f, -0.47f}, {0.03f, -0.2f}, {0.03f, 0.2f}, {0.03f, 0.47f}, {0.0f, 0.5f}}, true, true));
}

Neon add_neon(Asset& asset, Vec3 color, float candela, float range, float glow) {
  const int material = asset.add_material(
      {{"emissiveFactor", array_of(color)},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", glow}}}}},
       {"pbrMetallicRoughness", {{"baseColorFactor", {0.0, 0.0, 0.0, 1.0}}, {"metallicFactor", 0.0}}}});
  const int light =
      asset.add_light({{"type", "point"}, {"color", array_of(color)}, {"intensity", candela}, {"range", range}});
  return {color, light, asset.add_mesh(tube(), material)};
}

// The tube of `length` at `at` along `way`, and two lights beside it at `towards` the room.
void add_tube(Asset& asset, const Neon& neon, Vec3 at, Vec3 way, float length, Vec3 towards) {
  const glm::quat turn = way.y > 0.5f ? glm::quat(1, 0, 0, 0) : glm::angleAxis(0.5f * kPi, Vec3(1, 0, 0));
  asset.add_node({{"name", "tube"},
                  {"mesh", neon.mesh},
                  {"translation", array_of(at)},
                  {"rotation", array_of(turn)},
                  {"scale", {1.0, length, 1.0}}});
  for (const float end : {-0.27f, 0.27f})
    asset.add_node({{"name", "glow"},
                    {"translation", array_of(at + way * (length * end) + towards)},
                    {"extensions", {{"KHR_lights_punctual", {{"light", neon.light}}}}}});
}

void add_tubes(Asset& asset) {
  const Neon white = add_neon(asset, {1.0f, 0.80f, 0.58f}, 1.3f, 2.7f, 9.0f);
  const std::array<Neon, 4> colors = {
      add_neon(asset, {0.10f, 0.62f, 1.0f}, 1.1f, 1.9f, 7.0f), add_neon(asset, {1.0f, 0.13f, 0.42f}, 1.2f, 1.9f, 7.0f),
      add_neon(asset, {1.0f, 0.46f, 0.08f}, 1.1f, 1.9f, 7.0f), add_neon(asset, {0.16f, 1.0f, 0.48f}, 0.9f, 1.9f, 7.0f)};
  for (int bay = 0; bay < kBays; ++bay) {
    const float z = kNearEnd - kBay * (static_cast<float>(bay) + 0.5f);
    for (const float side : {-1.0f, 1.0f}) {
      add_tube(asset, white, {side * 0.95f, kCeiling - 0.1f, z}, {0, 0, 1}, 1.3f, {0, -0.12f, 0});
      const auto color = static_cast<std::size_t>(side < 0 ? bay / 2 : bay / 2 + 2) % colors.size();
      add_tube(asset, colors[color], {side * (kHalfWidth - 0.17f), 1.05f, z}, {0, 1, 0}, 1.3f, {-side * 0.14f, 0, 0});
    }
  }
}

// Panes of tinted glass across one half of the corridor, in steel frames.
void add_panes(Asset& asset) {
  const int steel = asset.add_material(material_of(Vec3(0.20f, 0.20f, 0.22f), 1.0f, 0.3f));
  const std::array<Vec3, 4> tints = {Vec3(0.25f, 0.55f, 0.70f), Vec3(0.70f, 0.45f, 0.25f), Vec3(0.30f, 0.65f, 0.45f),
                                     Vec3(0.60f, 0.30f, 0.55f)};
  for (std::size_t k = 0; k < tints.size(); ++k) {
    const float z = -4.0f - 6.0f * static_cast<float>(k), side = k & 1 ? 1.0f : -1.0f;
    const float a = side * (kHalfWidth - 0.16f), b = side * 0.55f, low = std::min(a, b), high = std::max(a, b);
    json glass = material_of(tints[k], 0.0f, 0.08f);
    glass["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.3;
    glass["alphaMode"] = "BLEND", glass["doubleSided"] = true;
    Geometry pane, frame;
    add_rectangle(pane, {low, 0.06f, z}, {high - low, 0, 0}, {0, 2.3f, 0}, 1, 2);
    for (const float x : {low, high - 0.06f})
      add_box(frame, {x, 0, z - 0.04f}, {x + 0.06f, 2.42f, z + 0.04f}, kAllFaces, 1);
    for (const float y : {0.0f, 2.36f}) add_box(frame, {low, y, z - 0.04f}, {high, y + 0.06f, z + 0.04f}, kAllFaces, 1);
    frame.colors.clear();
    asset.add_node({{"name", "pane"}, {"mesh", asset.add_mesh({{frame, steel}, {pane, asset.add_material(glass)}})}});
  }
}

// Adds objects on pedestals below spot lights, which cast their shadows.
void add_shown(Asset& asset) {
  const int stone = asset.add_material(material_of(Vec3(0.5f, 0.49f, 0.46f), 0.0f, 0.6f)),
            glaze = asset.add_material(material_of(Vec3(0.72f, 0.70f, 0.64f), 0.0f, 0.2f)),
            brass = asset.add_material(material_of(Vec3(0.90f, 0.66f, 0.30f), 1.0f, 0.25f));
  Geometry block;
  add_box(block, {-0.24f, 0, -0.24f}, {0.24f, 0.8f, 0.24f}, kNoBottom, 1.0f);
  block.colors.clear();
  const Geometry vase = revolve(smooth_profile(
                     {{0.0f, 0.0f}, {0.12f, 0.0f}, {0.21f, 0.22f}, {0.14f, 0.42f}, {0.07f, 0.52f}, {0.11f, 0.62f}},
                     true, false)),
                 ball = revolve(smooth_profile({{0.0f, 0.0f}, {0.2f, 0.1f}, {0.25f, 0.25f}, {0.2f, 0.4f}, {0.0f, 0.5f}},
                                               true, true));
  const std::array<int, 2> things = {asset.add_mesh(vase, glaze), asset.add_mesh(ball, brass)};
  const int pedestal = asset.add_mesh(block, stone);
  json& cast = asset.capture_settings()["shadows"];
  for (int k = 0; k < 4; ++k) {
    const float z = -2.6f - 6.0f * static_cast<float>(k), side = k & 1 ? -1.0f : 1.0f;
    const std::size_t kind = static_cast<std::size_t>(k) % things.size();
    asset.add_node({{"name", "pedestal"}, {"mesh", pedestal}, {"translation", {side * 1.1f, 0.0, z}}});
    asset.add_node({{"name", "shown"}, {"mesh", things[kind]}, {"translation", {side * 1.1f, 0.8, z}}});
    const int light = asset.add_light({{"type", "spot"},
                                       {"color", {1.0, 0.86, 0.66}},
                                       {"intensity", 30.0},
                                       {"range", 6.0},
                                       {"spot", {{"innerConeAngle", 0.35}, {"outerConeAngle", 0.62}}}});
    json lamp = look_at({side * 0.35f, kCeiling - 0.25f, z + 1.1f}, {side * 1.1f, 0.6f, z - 0.1f});
    lamp["name"] = "spot";
    lamp["extensions"]["KHR_lights_punctual"]["light"] = light;
    asset.add_node(lamp);
    cast.push_back({{"light", light}, {"size", 512}});
  }
}

void add_corridor_view(Asset& asset) {
  std::vector<float> times;
  std::vector<Vec3> eyes, targets;
  for (int k = 0; k <= 4; ++k) {
    times.push_back(0.25f * static_cast<float>(k));
    eyes.emplace_back(-0.35f + 0.1f * times.back(), 1.5f, 1.3f - 1.2f * times.back());
    targets.emplace_back(0.1f, 1.25f, -8.0f - 1.2f * times.back());
  }
  json view = look_at(eyes.front(), targets.front());
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.95}, {"znear", 0.1}, {"zfar", 60.0}}}});
  animate_look(asset, asset.add_node(view), times, eyes, targets);
  asset.set_environment(
      16, 8, [](Vec3 way) { return mix(Vec3(0.02f, 0.022f, 0.03f), Vec3(0.09f, 0.08f, 0.07f), std::max(way.y, 0.0f)); },
      "corridor_dim");
  json& settings = asset.capture_settings();
  settings["resolution"] = {1280, 720}, settings["frameRate"] = 24;
  settings["frames"] = {{"first", 0}, {"count", 24}};
}

// The tubes glow around themselves: a bloom over six levels, and a tone map that adds it.
void add_passes(Asset& asset) {
  json& settings = asset.capture_settings();
  settings["attachments"] = {{"lit", {{"format", "rgba16f"}}},
                             {"glow", {{"format", "r11g11b10f"}, {"scale", 0.5}, {"levels", 6}}}};
  settings["passes"] = {{{"name", "main"}, {"draw", "all"}, {"shader", "forward"}, {"write", {"lit"}}},
                        {{"name", "bloom"}, {"shader", "bloom"}, {"sample", {"lit"}}, {"write", {"glow"}}},
                        {{"name", "final"}, {"shader", "tonemap"}, {"sample", {"lit", "glow"}}, {"write", {"frame"}}}};
}

}  // namespace

void make_corridor(const std::filesystem::path& folder) {
  Asset asset("corridor");
  add_shell(asset);
  add_tubes(asset);
  add_panes(asset);
  add_shown(asset);
  add_corridor_view(asset);
  add_passes(asset);
  asset.write(folder);
}

}  // namespace tessera::captures
