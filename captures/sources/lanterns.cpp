#include "captures/sources/lanterns.h"

#include <cmath>

#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

constexpr float kDegree = kPi / 180.0f;

// The rotation that turns -z, the direction of a light, towards `way`. For ways straight up or down it is about +x.
glm::quat shining(Vec3 way) {
  const Vec3 back = -glm::normalize(way);
  const Vec3 side = std::abs(back.y) > 0.999f ? Vec3(1, 0, 0) : glm::normalize(glm::cross(Vec3(0, 1, 0), back));
  return glm::quat_cast(Mat3(side, glm::cross(back, side), back));
}

}  // namespace

Lanterns::Lanterns(Asset& asset) : asset_(asset) {
  const auto metal = [&](Vec3 color, bool double_sided) {
    return asset.add_material(
        {{"doubleSided", double_sided},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {color.x, color.y, color.z, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.4}}}});
  };
  const int iron = metal(Vec3(0.03f, 0.035f, 0.035f), false), tin = metal(Vec3(0.10f, 0.16f, 0.13f), true),
            glow =
                asset.add_material({{"emissiveFactor", {1.0, 0.72, 0.38}},
                                    {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3.0}}}}},
                                    {"pbrMetallicRoughness", {{"baseColorFactor", {0.0, 0.0, 0.0, 1.0}}}}});
  // The lantern's axis is +y here, and a node turns it to +z, against the light's direction. The light itself is at
  // the origin, at the shade's mouth and in front of the bulb: neither lies in its beam.
  const Geometry shade = revolve(
                     smooth_profile({{0.15f, 0.03f}, {0.11f, 0.10f}, {0.05f, 0.15f}, {0.02f, 0.20f}}, false, false)),
                 bulb = revolve(
                     smooth_profile({{0.0f, 0.01f}, {0.045f, 0.05f}, {0.03f, 0.10f}, {0.0f, 0.12f}}, true, true));
  lantern_ = asset.add_mesh({{shade, tin}, {bulb, glow}});
  const Geometry dish = revolve(smooth_profile({{0.10f, -0.10f}, {0.10f, -0.02f}}, false, false)),
                 glass = revolve(smooth_profile({{0.095f, -0.03f}, {0.05f, -0.025f}, {0.0f, -0.02f}}, false, true));
  dish_ = asset.add_mesh({{dish, iron}, {glass, glow}});
  // Posts and cords are one metre long and scaled.
  post_ = asset.add_mesh(
      revolve(smooth_profile({{0.035f, 0.0f}, {0.03f, 0.1f}, {0.022f, 0.9f}, {0.02f, 1.0f}}, false, false)), iron);
  cord_ = asset.add_mesh(revolve(smooth_profile({{0.006f, -1.0f}, {0.006f, 0.0f}}, false, false)), iron);
}

int Lanterns::add_spot(const Beam& beam) {
  const json cone = {{"innerConeAngle", beam.inner * kDegree}, {"outerConeAngle", beam.outer * kDegree}};
  return asset_.add_light(
      {{"type", "spot"}, {"color", {1.0, 0.74, 0.43}}, {"intensity", beam.candela}, {"spot", cone}});
}

int Lanterns::add_shining(Vec3 at, Vec3 target, int light, bool up) {
  const int body = asset_.add_node({{"name", up ? "dish" : "lantern"},
                                    {"mesh", up ? dish_ : lantern_},
                                    {"rotation", array_of(glm::angleAxis((up ? -0.5f : 0.5f) * kPi, Vec3(1, 0, 0)))}});
  return asset_.add_node({{"name", "light"},
                          {"translation", array_of(at)},
                          {"rotation", array_of(shining(target - at))},
                          {"children", {body}},
                          {"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
}

int Lanterns::add_on_post(Vec3 foot, float height, Vec3 target, const Beam& beam) {
  const Vec3 top = foot + Vec3(0, height, 0), way = glm::normalize((target - foot) * Vec3(1, 0, 1)),
             arm = glm::normalize(way + Vec3(0, 0.35f, 0));
  asset_.add_node(
      {{"name", "post"}, {"mesh", post_}, {"translation", array_of(foot)}, {"scale", {1.0, height + 0.12f, 1.0}}});
  // An arm half as thick as the post carries the lantern.
  asset_.add_node(
      {{"name", "arm"},
       {"mesh", post_},
       {"translation", array_of(top + Vec3(0, 0.06f, 0))},
       {"rotation", array_of(glm::angleAxis(std::acos(arm.y), glm::normalize(glm::cross(Vec3(0, 1, 0), arm))))},
       {"scale", {0.5, 0.38, 0.5}}});
  const int light = add_spot(beam);
  add_shining(top + way * 0.36f - Vec3(0, 0.03f, 0), target, light, false);
  return light;
}

int Lanterns::add_on_cord(Vec3 hook, float length, const Beam& beam, const std::vector<float>& times, float phase) {
  const int light = add_spot(beam),
            lantern = add_shining({0, -length - 0.19f, 0}, {0, -length - 1.0f, 0}, light, false),
            cord = asset_.add_node({{"name", "cord"}, {"mesh", cord_}, {"scale", {1.0, length, 1.0}}}),
            pivot = asset_.add_node({{"name", "hook"}, {"translation", array_of(hook)}, {"children", {cord, lantern}}});
  // A pendulum of that length, which gusts push sideways.
  const float speed = std::sqrt(9.81f / (length + 0.2f));
  std::vector<glm::quat> swings;
  for (const float t : times)
    swings.push_back(glm::angleAxis(0.16f * std::sin(speed * t + phase), Vec3(0, 0, 1)) *
                     glm::angleAxis(0.07f * std::sin(1.13f * speed * t + 2.0f * phase), Vec3(1, 0, 0)));
  asset_.animate(pivot, "rotation", times, swings);
  return light;
}

int Lanterns::add_from_below(Vec3 at, Vec3 target, const Beam& beam) {
  const int light = add_spot(beam);
  add_shining(at, target, light, true);
  return light;
}

}  // namespace tessera::captures
