#include "scene/animated_values.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/pose.h"

namespace tessera::scene {
namespace {

constexpr double kFloatMax = static_cast<double>(std::numeric_limits<float>::max());
constexpr double kLeast = 1e-6;  // of what must be above zero

bool is_of_material(AnimatedPath path) {
  return path >= AnimatedPath::kMaterialNumber && path <= AnimatedPath::kTextureScale;
}
bool is_of_camera(AnimatedPath path) { return path >= AnimatedPath::kFieldOfView && path <= AnimatedPath::kFar; }
bool is_of_light(AnimatedPath path) { return path >= AnimatedPath::kLightColor && path <= AnimatedPath::kOuterCone; }

// Calls visit(channel, its values) for the played channels of the paths that `wanted` accepts.
template <class Wanted, class Visit>
void for_each_value(const Capture& capture, double time, const Wanted& wanted, const Visit& visit) {
  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels)
      if (wanted(channel.path)) visit(channel, evaluate_channel(channel, time));
}

float within(double value, double low, double high) { return static_cast<float>(std::clamp(value, low, high)); }

void set_value(const AnimationChannel& channel, const std::vector<double>& v, Material& material) {
  const auto part = static_cast<std::size_t>(channel.part);
  if (channel.path == AnimatedPath::kMaterialNumber) {
    const MaterialNumber& number = material_numbers()[part];
    float* to = number.of(material);
    for (std::size_t c = 0; c < v.size(); ++c) to[c] = number.range.nearest(v[c]);
    if (to == &material.emissive_factor.x || to == &material.emissive_strength)
      material.emissive = material.emissive_factor * material.emissive_strength;
    return;
  }
  TextureSlot& slot = *material.slots()[part];
  const auto any = [](double value) { return within(value, -kFloatMax, kFloatMax); };
  if (channel.path == AnimatedPath::kTextureOffset) slot.shift.offset = {any(v[0]), any(v[1])};
  if (channel.path == AnimatedPath::kTextureRotation) slot.shift.rotation = any(v[0]);
  if (channel.path == AnimatedPath::kTextureScale) slot.shift.scale = {any(v[0]), any(v[1])};
  slot.transform = slot.shift.transform();
}

}  // namespace

void animate_materials(const Capture& capture, double time, std::span<const int> source,
                       std::vector<Material>& materials) {
  for_each_value(capture, time, is_of_material, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    for (std::size_t m = 0; m < materials.size(); ++m)
      if (source[m] == channel.object) set_value(channel, v, materials[m]);
  });
}

Camera animate_camera(const Capture& capture, double time, int camera, Camera base) {
  for_each_value(capture, time, is_of_camera, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    if (channel.object != camera) return;
    switch (channel.path) {
      case AnimatedPath::kFieldOfView:
        base.vertical_fov = within(v[0], kLeast, 3.14159);
        break;
      case AnimatedPath::kXMag:
        base.x_mag = within(std::abs(v[0]), kLeast, kFloatMax);
        break;
      case AnimatedPath::kYMag:
        base.y_mag = within(std::abs(v[0]), kLeast, kFloatMax);
        break;
      case AnimatedPath::kNear:
        base.near = within(v[0], base.type == Camera::Type::kPerspective ? kLeast : 0, kFloatMax);
        break;
      default:
        base.far = within(v[0], kLeast, kFloatMax);
        break;
    }
  });
  if (base.far != 0 && !(base.far > base.near))
    base.far = std::nextafter(base.near, std::numeric_limits<float>::infinity());
  return base;
}

std::vector<shaders::Light> animate_lights(const Capture& capture, double time) {
  std::vector<shaders::Light> lights = capture.lights;
  std::vector<LightParameters> parameters = capture.light_parameters;
  for_each_value(capture, time, is_of_light, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    const auto l = static_cast<std::size_t>(channel.object);
    constexpr double kHalfPi = 1.5707963267948966;
    switch (channel.path) {
      case AnimatedPath::kLightColor:
        for (int c = 0; c < 3; ++c) parameters[l].color[c] = within(v[static_cast<std::size_t>(c)], 0, kFloatMax);
        break;
      case AnimatedPath::kLightIntensity:
        parameters[l].intensity = within(v[0], 0, kFloatMax);
        break;
      case AnimatedPath::kLightRange:
        lights[l].range = within(v[0], kLeast, kFloatMax);
        break;
      case AnimatedPath::kInnerCone:
        parameters[l].inner_cone = std::clamp(v[0], 0.0, kHalfPi);
        break;
      default:
        parameters[l].outer_cone = std::clamp(v[0], kLeast, kHalfPi);
        break;
    }
    // The inner cone is the smaller one.
    const double inner = std::min(parameters[l].inner_cone, parameters[l].outer_cone * (1 - 1e-3));
    LightParameters now = parameters[l];
    now.inner_cone = inner;
    now.apply(lights[l]);
  });
  return lights;
}

std::vector<MaterialValue> animated_material_values(const Capture& capture, double time) {
  std::vector<MaterialValue> values;
  for_each_value(capture, time, is_of_material, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    for (const double value : v) values.push_back({channel.object, value});
  });
  return values;
}

}  // namespace tessera::scene
