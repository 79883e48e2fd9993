#include <algorithm>
#include <cmath>

#include "captures/sources/patterns.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

// Dragon's eggs: a lathe of four segments, scales all over.
Geometry egg() {
  return revolve(
      smooth_profile({{0.0f, 0.0f}, {0.43f, 0.16f}, {0.57f, 0.60f}, {0.40f, 1.12f}, {0.0f, 1.42f}}, true, true));
}

Geometry orb() {
  std::vector<Vec2> arc;
  for (int i = 0; i <= 4; ++i)
    arc.emplace_back(std::sin(kPi * static_cast<float>(i) / 4.0f), -std::cos(kPi * static_cast<float>(i) / 4.0f));
  arc.front().x = arc.back().x = 0.0f;
  std::vector<ProfileSegment> profile = smooth_profile(arc, true, true);
  // Exact quarter tangents of a circle.
  constexpr float kArc = 0.2651784f;
  for (std::size_t s = 0; s < 4; ++s) {
    const auto tangent = [](Vec2 p) { return Vec2(-p.y, p.x); };
    profile[s][1] = profile[s][0] + tangent(profile[s][0]) * kArc;
    profile[s][2] = profile[s][3] - tangent(profile[s][3]) * kArc;
  }
  return revolve(profile);
}

struct EggLook {
  Vec3 low, high;  // colours from the bottom to the tip
  float metallic, roughness;
};

// Colour of a whole egg: a gradient with speckles, the rims of scales darker.
Image8 egg_colors(const EggLook& look, std::uint32_t seed) {
  return color_image(256, 256, [&](float u, float v) {
    const float rise = 1.0f - v, cloud = noise(u, v, 6, 4, seed);
    Vec3 color = mix(look.low, look.high, smooth_step(0.15f, 0.9f, rise + 0.35f * (cloud - 0.5f)));
    color *= 0.62f + 0.5f * noise(u, v, 40, 2, seed + 7);
    const float rim = scales(u * 9.0f - std::floor(u * 9.0f), v * 6.0f - std::floor(v * 6.0f));
    return color * (0.45f + 0.65f * rim);
  });
}

Image16 cobble_heights() {
  return height_image(256, 256, [](float u, float v) {
    const Cell c = cells(u, v, 5, 4, 0.7f, 11);
    const float dome = smooth_step(0.02f, 0.30f, c.second - c.nearest);
    const float tilt = 0.12f * static_cast<float>(c.number % 5u) / 5.0f;
    return 0.08f + dome * (0.62f + tilt) + 0.16f * noise(u, v, 24, 3, 5);
  });
}

Image8 cobble_colors() {
  return color_image(256, 256, [](float u, float v) {
    const Cell c = cells(u, v, 5, 4, 0.7f, 11);
    const float dome = smooth_step(0.02f, 0.16f, c.second - c.nearest);
    const float shade = 0.75f + 0.25f * static_cast<float>(c.number * 7u % 11u) / 11.0f;
    const Vec3 stone =
        mix(Vec3(0.42f, 0.40f, 0.38f), Vec3(0.55f, 0.47f, 0.40f), static_cast<float>(c.number * 5u % 7u) / 7.0f) *
        shade;
    return mix(Vec3(0.16f, 0.19f, 0.11f), stone, dome) * (0.75f + 0.4f * noise(u, v, 32, 3, 21));
  });
}

Image16 crater_heights() {
  return height_image(128, 128, [](float u, float v) {
    const Cell c = cells(u, v, 6, 6, 0.8f, 31);
    return 0.55f - 0.5f * smooth_step(0.45f, 0.1f, c.nearest) +
           0.25f * smooth_step(0.30f, 0.42f, c.nearest) * smooth_step(0.58f, 0.45f, c.nearest) +
           0.15f * noise(u, v, 16, 3, 9);
  });
}

Image8 ember_glow() {
  return color_image(128, 128, [](float u, float v) {
    const float heat = smooth_step(0.34f, 0.05f, cells(u, v, 6, 6, 0.8f, 31).nearest);
    return Vec3(1.0f, 0.45f, 0.12f) * heat;
  });
}

// Place of an egg and its look; the first egg is the middle one.
struct Place {
  std::size_t look;
  Vec3 at;
  float size, lean;
};
const Place kPlaces[] = {{0, {0.05f, -0.03f, 0.35f}, 1.30f, 0.0f},  {1, {-1.75f, 0.0f, -0.55f}, 1.12f, 0.14f},
                         {2, {1.75f, 0.0f, -0.75f}, 1.05f, -0.16f}, {3, {0.95f, 0.0f, 1.55f}, 0.62f, 0.30f},
                         {3, {-3.6f, 0.0f, -3.2f}, 1.05f, 0.05f},   {1, {3.9f, 0.0f, -3.4f}, 1.15f, -0.08f},
                         {2, {-0.9f, 0.0f, -3.9f}, 0.95f, 0.12f},   {0, {-1.75f, 0.0f, 2.75f}, 0.55f, -0.25f}};

// Makes one mesh for each look.
std::vector<int> add_shells(Asset& asset, int scale_heights) {
  const Geometry shape = egg();
  const EggLook looks[] = {{{0.10f, 0.30f, 0.33f}, {0.30f, 0.85f, 0.72f}, 0.35f, 0.30f},
                           {{0.42f, 0.04f, 0.06f}, {0.95f, 0.36f, 0.18f}, 0.25f, 0.34f},
                           {{0.25f, 0.12f, 0.42f}, {0.66f, 0.52f, 0.95f}, 0.30f, 0.30f},
                           {{0.62f, 0.40f, 0.10f}, {1.00f, 0.83f, 0.42f}, 0.90f, 0.28f}};
  std::vector<int> meshes;
  for (std::size_t l = 0; l < 4; ++l) {
    const int colors = asset.add_color_texture(egg_colors(looks[l], static_cast<std::uint32_t>(100 + 10 * l)),
                                               "eggs_shell_" + std::to_string(l));
    meshes.push_back(asset.add_mesh(shape, asset.add_material(displaced({{"name", "shell " + std::to_string(l)},
                                                                         {"pbrMetallicRoughness",
                                                                          {{"baseColorTexture", texture_info(colors)},
                                                                           {"metallicFactor", looks[l].metallic},
                                                                           {"roughnessFactor", looks[l].roughness}}}},
                                                                        scale_heights, Vec2(9, 6), 0.075f, -0.01f))));
  }
  return meshes;
}

void add_ground(Asset& asset, int cobbles) {
  const Vec2 low(-7.5f, -4.5f), high(7.5f, 6.5f);
  std::vector<Blob> blobs;
  for (const Place& p : kPlaces) blobs.push_back({{p.at.x, -p.at.z}, 0.62f * p.size});
  json occlusion = texture_info(asset.add_data_texture(contact_shade(blobs, low, high), "eggs_shade"));
  json stone = {
      {"name", "cobbles"},
      {"pbrMetallicRoughness",
       {{"baseColorTexture", texture_info(asset.add_color_texture(cobble_colors(), "eggs_stone"), Vec2(5, 4))},
        {"metallicFactor", 0.0},
        {"roughnessFactor", 0.62}}},
      {"occlusionTexture", occlusion}};
  asset.add_node({{"name", "ground"},
                  {"mesh", asset.add_mesh(ground(low, high, 20, 15),
                                          asset.add_material(displaced(stone, cobbles, Vec2(5, 4), 0.20f, -0.12f)))}});
}

// Returns the node of the middle egg.
int add_eggs(Asset& asset, const std::vector<int>& meshes) {
  int first_egg = -1;
  for (const Place& p : kPlaces) {
    const glm::quat lean = glm::angleAxis(p.lean, Vec3(0, 0, 1)) * glm::angleAxis(p.at.x * 1.7f, Vec3(0, 1, 0));
    const int node = asset.add_node({{"name", "egg"},
                                     {"mesh", meshes[p.look]},
                                     {"translation", array_of(p.at)},
                                     {"rotation", array_of(lean)},
                                     {"scale", {p.size, p.size, p.size}}});
    if (first_egg < 0) first_egg = node;
  }
  return first_egg;
}

// Motions: times in seconds, and the places at these times.
struct Motions {
  std::vector<float> times;
  std::vector<glm::quat> rocking, spin;
  std::vector<Vec3> flight;
};

Motions motions() {
  Motions m;
  for (int k = 0; k <= 32; ++k) {
    const float t = static_cast<float>(k) / 24.0f;
    m.times.push_back(t);
    m.rocking.push_back(glm::angleAxis(0.085f * std::sin(2.0f * kPi * 1.5f * t), Vec3(0, 0, 1)));
    m.spin.push_back(glm::angleAxis(2.2f * t, glm::normalize(Vec3(0.3f, 1.0f, 0.2f))));
    m.flight.emplace_back(-5.0f + 6.2f * t, 2.12f - 0.9f * (t - 0.62f) * (t - 0.62f), -0.15f + 0.5f * t);
  }
  return m;
}

void add_comet(Asset& asset, int craters, const Motions& m) {
  const int ember = asset.add_material(
      displaced({{"name", "ember"},
                 {"emissiveTexture", texture_info(asset.add_color_texture(ember_glow(), "eggs_ember"), Vec2(2, 1))},
                 {"emissiveFactor", {1.0, 1.0, 1.0}},
                 {"pbrMetallicRoughness",
                  {{"baseColorFactor", {0.20, 0.17, 0.16, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.8}}}},
                craters, Vec2(2, 1), 0.22f, -0.1f));
  const int comet =
      asset.add_node({{"name", "ember"}, {"mesh", asset.add_mesh(orb(), ember)}, {"scale", {0.3, 0.3, 0.3}}});
  asset.animate(comet, "translation", m.times, m.flight);
  asset.animate(comet, "rotation", m.times, m.spin);
}

void add_lights(Asset& asset, const Motions& m) {
  const int sun = asset.add_light({{"type", "directional"}, {"color", {1.0, 0.90, 0.76}}, {"intensity", 1.1}});
  json key = look_at({-4.0f, 5.5f, 4.0f}, {0, 0, 0});
  key["extensions"]["KHR_lights_punctual"]["light"] = sun;
  asset.add_node(key);
  const int fire = asset.add_light({{"type", "point"}, {"color", {1.0, 0.5, 0.2}}, {"intensity", 6.0}, {"range", 6.0}});
  json flame = {{"extensions", {{"KHR_lights_punctual", {{"light", fire}}}}},
                {"translation", array_of(m.flight.front())}};
  asset.animate(asset.add_node(flame), "translation", m.times, m.flight);
}

void add_view(Asset& asset) {
  const Vec3 eye(0.75f, 2.35f, 6.1f), target(0.02f, 0.78f, 0.0f);
  const int camera =
      asset.add_camera({{"type", "perspective"},
                        {"perspective", {{"yfov", 0.60}, {"znear", 0.3}, {"zfar", 60.0}}},
                        {"extensions", {{"TESSERA_lens", {{"apertureRadius", 0.085}, {"focusDistance", 5.75}}}}}});
  json view = look_at(eye, target);
  view["camera"] = camera;
  view["name"] = "camera";
  asset.add_node(view);
  asset.capture_settings() = {{"resolution", {1280, 720}}, {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},     {"frames", {{"first", 14}, {"count", 1}}},
                              {"environment", 0.85},       {"exposure", 0.95}};
}

}  // namespace

void make_eggs(const std::filesystem::path& folder) {
  Asset asset("eggs");
  const int scale_heights =
      asset.add_height_texture(height_image(128, 128, [](float u, float v) { return scales(u, v); }), "eggs_scales");
  const int cobbles = asset.add_height_texture(cobble_heights(), "eggs_cobbles");
  const int craters = asset.add_height_texture(crater_heights(), "eggs_craters");
  const std::vector<int> shells = add_shells(asset, scale_heights);
  add_ground(asset, cobbles);
  const int middle = add_eggs(asset, shells);
  const Motions moving = motions();
  asset.animate(middle, "rotation", moving.times, moving.rocking);  // about to hatch
  add_comet(asset, craters, moving);
  add_lights(asset, moving);
  add_view(asset);
  asset.write(folder);
}

}  // namespace tessera::captures
