#include "captures/sources/outdoors.h"

#include <algorithm>
#include <cmath>

#include "captures/sources/patterns.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

// u runs around, v from the zenith down.
Image8 sky_colors(const Sky& sky) {
  return color_image(512, 256, [&](float u, float v) {
    const float down = std::min(v / 0.5f, 1.0f);  // 1 at the horizon
    const Vec3 blue = mix(sky.zenith, sky.horizon, std::pow(down, 1.6f));
    const float cloud = smooth_step(0.50f, 0.74f, noise(u, v * 2.0f, 10, 5, 97)) * smooth_step(0.1f, 0.5f, down);
    const float lit = 0.86f + 0.12f * noise(u, v * 2.0f, 24, 3, 98);
    return mix(blue, lit * sky.clouds, sky.cover * cloud);
  });
}

bool hides(const Block& b, Vec3 from, Vec3 direction) {
  float enter = 0.0f, leave = 1e9f;
  for (int axis = 0; axis < 3; ++axis) {
    const float a = (b.low[axis] - from[axis]) / direction[axis], c = (b.high[axis] - from[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, c));
    leave = std::min(leave, std::max(a, c));
  }
  return enter < leave;
}

// Length of a ray's path through a crown, in units of the crown's radii.
float way_through(const Foliage& f, Vec3 from, Vec3 direction) {
  const Vec3 o = (from - f.middle) / f.radii, d = glm::normalize(direction / f.radii);
  const float along = glm::dot(o, d), reach = along * along - glm::dot(o, o) + 1.0f;
  return reach <= 0.0f || along > 0.0f ? 0.0f : 2.0f * std::sqrt(reach);
}

}  // namespace

void add_sky(Asset& asset, const Sky& sky) {
  constexpr float kCircle = 6.2831853f;
  // Seen from inside.
  const Geometry dome = mesh_of(
      [](float u, float v) {
        const float around = u * kCircle, down = v * 0.5f * kCircle;
        return Vec3(std::sin(down) * std::sin(around), std::cos(down), std::sin(down) * std::cos(around)) * 420.0f;
      },
      32, 24);
  const int material =
      asset.add_material({{"pbrMetallicRoughness",
                           {{"baseColorTexture", texture_info(asset.add_color_texture(sky_colors(sky), sky.file))}}},
                          {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  asset.add_node({{"name", "sky"}, {"mesh", asset.add_mesh(dome, material)}});
}

int add_sun(Asset& asset, const Sun& sun) {
  const int light = asset.add_light({{"type", "directional"}, {"color", sun.color}, {"intensity", sun.intensity}});
  json key = look_at(sun.to_sun, Vec3(0));
  key["extensions"]["KHR_lights_punctual"]["light"] = light;
  asset.add_node(key);
  return light;
}

Geometry lit(Geometry geometry, Shadows shadows) {
  if (shadows == Shadows::kCast) geometry.colors.clear();
  return geometry;
}

std::vector<Part> lit(std::vector<Part> parts, Shadows shadows) {
  for (Part& part : parts) part.geometry = lit(std::move(part.geometry), shadows);
  return parts;
}

float sunlight(const Shades& shades, Vec3 at) {
  constexpr int kRays = 16;
  float sum = 0.0f;
  for (int k = 0; k < kRays; ++k) {
    const Vec2 spread = Vec2(static_cast<float>(k % 4), static_cast<float>(k / 4)) * 0.012f - 0.018f;
    const Vec3 to_sun = kToSun + Vec3(spread.x, 0.0f, spread.y);
    if (std::any_of(shades.blocks.begin(), shades.blocks.end(), [&](const Block& b) { return hides(b, at, to_sun); }))
      continue;
    float thick = 0.0f;
    for (const Foliage& f : shades.crowns) thick += way_through(f, at, to_sun);
    sum += std::exp(-1.5f * thick);
  }
  return sum / kRays;
}

void animate_look(Asset& asset, int node, const std::vector<float>& times, const std::vector<Vec3>& eyes,
                  const std::vector<Vec3>& targets) {
  std::vector<glm::quat> turns;
  for (std::size_t k = 0; k < times.size(); ++k) {
    const std::vector<float> q = look_at(eyes[k], targets[k])["rotation"].get<std::vector<float>>();
    turns.emplace_back(q[3], q[0], q[1], q[2]);
  }
  asset.animate(node, "translation", times, eyes);
  asset.animate(node, "rotation", times, turns);
}

}  // namespace tessera::captures
