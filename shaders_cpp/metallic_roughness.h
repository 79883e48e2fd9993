#pragma once

#include <span>

#include "base/real.h"
#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/environment.h"

namespace tessera::shaders {

// Pixel shader of glTF's metallic-roughness material (glTF 2.0, appendix B): GGX distribution, height-correlated Smith
// visibility, Schlick's Fresnel, Lambert diffuse. All colours are linear light.

// What textures and factors give for one point.
template <class Real>
struct MaterialPoint {
  Vector3<Real> base_color;
  Real metallic, roughness;  // perceptual roughness in [0, 1]
  Real occlusion;            // 1 = unoccluded; dims the environment only
  Vector3<Real> emissive;
};

inline constexpr float kPi = 3.14159265358979323846f;
// Below this the highlight of a point light is smaller than a float's idea of it.
inline constexpr float kMinRoughness = 0.045f;

template <class Real>
Real clamp_unit(Real x) {
  return real_min(real_max(x, Real(0)), Real(1));
}

// Light reflected towards `view` for light of unit irradiance from `light` (both unit vectors away from the point,
// dot(normal, view) > 0): BRDF times cosine.
template <class Real>
Vector3<Real> reflect_light(const MaterialPoint<Real>& m, const Vector3<Real>& normal, const Vector3<Real>& view,
                            const Vector3<Real>& light) {
  const Real n_l = dot(normal, light);
  if (!(n_l > Real(0))) return {};
  const Real n_v = real_max(dot(normal, view), Real(1e-4f));
  const Vector3<Real> sum = view + light;
  const Vector3<Real> half = sum * (Real(1) / real_sqrt(real_max(dot(sum, sum), Real(1e-12f))));
  const Real n_h = clamp_unit(dot(normal, half)), v_h = clamp_unit(dot(view, half));

  const Real roughness = real_max(m.roughness, Real(kMinRoughness));
  const Real alpha = roughness * roughness, alpha2 = alpha * alpha;
  const Real spread = n_h * n_h * (alpha2 - Real(1)) + Real(1);
  const Real distribution = alpha2 / (Real(kPi) * spread * spread);
  const Real visibility = Real(0.5f) / (n_l * real_sqrt(n_v * n_v * (Real(1) - alpha2) + alpha2) +
                                        n_v * real_sqrt(n_l * n_l * (Real(1) - alpha2) + alpha2));
  const Real grazing = Real(1) - v_h, grazing2 = grazing * grazing;
  const Real schlick = grazing2 * grazing2 * grazing;

  const auto channel = [&](Real color) {
    const Real f0 = Real(0.04f) * (Real(1) - m.metallic) + color * m.metallic;
    const Real fresnel = f0 + (Real(1) - f0) * schlick;
    const Real diffuse = (Real(1) - fresnel) * (Real(1) - m.metallic) * color * Real(1 / kPi);
    return (diffuse + fresnel * distribution * visibility) * n_l;
  };
  return {channel(m.base_color.x), channel(m.base_color.y), channel(m.base_color.z)};
}

// Scale and bias that turn a reflectance at normal incidence into the share of a uniform environment that is
// reflected (Karis 2014, "Physically based shading on mobile").
template <class Real>
struct EnvironmentFresnel {
  Real scale, bias;
};
template <class Real>
EnvironmentFresnel<Real> environment_fresnel(Real roughness, Real n_v) {
  const Real rx = Real(1) - roughness, ry = Real(0.0425f) - Real(0.0275f) * roughness;
  const Real rz = Real(1.04f) - Real(0.572f) * roughness, rw = Real(0.022f) * roughness - Real(0.04f);
  const Real a = real_min(rx * rx, real_exp2(Real(-9.28f) * n_v)) * rx + ry;
  return {rz - Real(1.04f) * a, rw + Real(1.04f) * a};
}

// A light of KHR_lights_punctual in world space.
struct Light {
  enum class Type { kDirectional, kPoint, kSpot };
  Type type = Type::kDirectional;
  Vec3 color{1.0f};  // linear, times intensity (lux, or candela for point and spot)
  Vec3 position{0.0f};
  Vec3 direction{0.0f, 0.0f, -1.0f};  // the way the light travels, unit
  float range = 0.0f;                 // 0 = unlimited
  float cos_inner = 1.0f, cos_outer = 0.0f;
};

// Irradiance on a surface facing the light at `point` and the unit vector towards the light.
struct IncidentLight {
  Vec3 irradiance;
  Vec3 to_light;
};
IncidentLight incident_light(const Light& light, Vec3 point);

// Light leaving `point` towards `view`: emission, environment and all lights.
Vec3 shade_metallic_roughness(const MaterialPoint<float>& material, Vec3 point, Vec3 normal, Vec3 view,
                              std::span<const Light> lights, const Environment& environment);

}  // namespace tessera::shaders
