#include "shaders_cpp/metallic_roughness.h"

#include <algorithm>
#include <cmath>

namespace tessera::shaders {
namespace {

Vector3<float> plain(Vec3 a) { return {a.x, a.y, a.z}; }
Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

}  // namespace

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
                              std::span<const Light> lights, const Environment& environment) {
  const float n_v = std::max(glm::dot(normal, view), 1e-4f);
  const Vec3 base = glm_vector(material.base_color);
  const Vec3 f0 = Vec3(0.04f) * (1.0f - material.metallic) + base * material.metallic;
  const EnvironmentFresnel<float> fresnel = environment_fresnel(material.roughness, n_v);
  const Vec3 mirror = normal * (2.0f * glm::dot(normal, view)) - view;
  const Vec3 reflected = (f0 * fresnel.scale + Vec3(fresnel.bias)) * environment.specular(mirror, material.roughness);
  const Vec3 scattered = base * ((1.0f - material.metallic) * 0.96f) * environment.diffuse(normal);
  Vec3 sum = glm_vector(material.emissive) + (reflected + scattered) * material.occlusion;
  for (const Light& light : lights) {
    const IncidentLight incident = incident_light(light, point);
    sum +=
        incident.irradiance * glm_vector(reflect_light(material, plain(normal), plain(view), plain(incident.to_light)));
  }
  return sum;
}

}  // namespace tessera::shaders
