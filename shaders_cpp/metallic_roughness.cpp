#include "shaders_cpp/metallic_roughness.h"

#include <algorithm>
#include <cmath>

namespace tessera::shaders {
namespace {

Vector3<float> plain(Vec3 a) { return {a.x, a.y, a.z}; }
Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

// Where the lobe of a reflection points: the mirror direction, for rough surfaces bent towards the normal, where masking
// and the horizon leave more of it. [fitted] By roughness cubed: with it spheres of white metal in the built-in studio
// come closest to the integral over their images.
Vec3 environment_direction(Vec3 normal, Vec3 view, float roughness) {
  const Vec3 mirror = normal * (2.0f * glm::dot(normal, view)) - view;
  const Vec3 bent = mirror + roughness * roughness * roughness * (normal - mirror);
  const float length2 = glm::dot(bent, bent);
  return length2 > 1e-12f ? bent / std::sqrt(length2) : normal;
}

}  // namespace

Light Lights::moved(const Light& from, const Light& to) const {
  const auto mix = [&](const auto& a, const auto& b) { return a * (1.0f - t) + b * t; };
  Light light = from;
  light.color = mix(from.color, to.color);
  light.position = mix(from.position, to.position);
  const Vec3 direction = mix(from.direction, to.direction);
  const float length2 = glm::dot(direction, direction);
  if (length2 > 1e-12f) light.direction = direction / std::sqrt(length2);
  if (from.range > 0.0f && to.range > 0.0f) light.range = mix(from.range, to.range);
  light.cos_inner = mix(from.cos_inner, to.cos_inner);
  light.cos_outer = mix(from.cos_outer, to.cos_outer);
  return light;
}

IncidentLight incident_light(const Light& light, Vec3 point) {
  if (light.type == Light::Type::kDirectional) return {light.color, -light.direction};
  const Vec3 offset = light.position - point;
  const float distance2 = std::max(glm::dot(offset, offset), 1e-8f);
  const Vec3 to_light = offset / std::sqrt(distance2);
  float attenuation = 1.0f / distance2;
  if (light.range > 0.0f) {
    // KHR_lights_punctual: smooth window that reaches zero at the range.
    const float ratio2 = distance2 / (light.range * light.range);
    attenuation *= std::clamp(1.0f - ratio2 * ratio2, 0.0f, 1.0f);
  }
  if (light.type == Light::Type::kSpot) {
    const float cosine = glm::dot(light.direction, -to_light);
    const float window =
        std::clamp((cosine - light.cos_outer) / std::max(light.cos_inner - light.cos_outer, 1e-4f), 0.0f, 1.0f);
    attenuation *= window * window;
  }
  return {light.color * attenuation, to_light};
}

Vec3 shade_metallic_roughness(const MaterialPoint<float>& material, Vec3 point, Vec3 normal, Vec3 view,
                              const Lights& lights, const Environment& environment) {
  const float n_v = std::max(glm::dot(normal, view), 1e-4f);
  const Vec3 base = glm_vector(material.base_color);
  const Vec3 f0 = Vec3(0.04f) * (1.0f - material.metallic) + base * material.metallic;
  const EnvironmentReflectance<float> reflectance = environment_reflectance(material.roughness, n_v);
  Vec3 single, multiple;
  for (int c = 0; c < 3; ++c) {
    const EnvironmentShares<float> shares = environment_shares(reflectance, f0[c]);
    single[c] = shares.single, multiple[c] = shares.multiple;
  }
  const EnvironmentShares<float> coat = environment_shares(reflectance, 0.04f);
  const Vec3 scattered = base * ((1.0f - material.metallic) * (1.0f - coat.single - coat.multiple));
  const Vec3 around = environment_direction(normal, view, material.roughness);
  const Vec3 reflected =
      single * environment.specular(around, material.roughness) + (multiple + scattered) * environment.diffuse(normal);
  Vec3 sum = glm_vector(material.emissive) + reflected * material.occlusion;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const IncidentLight incident = incident_light(lights.at(i), point);
    sum +=
        incident.irradiance * glm_vector(reflect_light(material, plain(normal), plain(view), plain(incident.to_light)));
  }
  return sum;
}

}  // namespace tessera::shaders
