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

// How a GGX surface reflects a uniform white environment, multiple scattering between its microfacets left out: a share
// of `albedo` where the reflectance at normal incidence is 1, of f0 * (albedo - grazing) + grazing otherwise. Rational
// fits to the integral over n_v in [0.02, 1] and roughness in [0.05, 1]: rms error 0.01 and 0.005, largest 0.041 and
// 0.032, at grazing views.
template <class Real>
struct EnvironmentReflectance {
  Real albedo, grazing;
};
template <class Real>
EnvironmentReflectance<Real> environment_reflectance(Real roughness, Real n_v) {
  const Real m = n_v, r = roughness, mm = m * m, rr = r * r, mr = m * r;
  const Real albedo = (Real(1.116464f) - Real(6.831859f) * r + Real(24.478816f) * rr - Real(6.443647f) * rr * r +
                       Real(24.041413f) * m - Real(11.348127f) * mr - Real(23.488263f) * mr * r - Real(3.610450f) * mm +
                       Real(10.800048f) * mm * r - Real(2.912097f) * mm * m) /
                      (Real(1) - Real(4.382400f) * r + Real(16.758996f) * rr + Real(24.428288f) * m -
                       Real(11.459734f) * mr - Real(5.802704f) * mm);
  const Real grazing = (Real(0.939250f) - Real(0.334970f) * r - Real(0.162989f) * rr - Real(2.130829f) * m +
                        Real(0.633539f) * mr + Real(1.142693f) * mm) /
                       (Real(1) - Real(0.595692f) * r + Real(13.782813f) * rr + Real(1.118732f) * m -
                        Real(10.554743f) * mr + Real(13.333790f) * mm);
  const Real all = clamp_unit(albedo);
  return {all, real_min(clamp_unit(grazing), all)};
}

// Shares of an environment that a surface of this reflectance at normal incidence returns: after one reflection, from
// around the mirror direction, and after several between microfacets, from everywhere (Fdez-Aguera 2019). Both are 1
// together where the reflectance is: nothing is lost.
template <class Real>
struct EnvironmentShares {
  Real single, multiple;
};
template <class Real>
EnvironmentShares<Real> environment_shares(const EnvironmentReflectance<Real>& r, Real f0) {
  const Real single = f0 * (r.albedo - r.grazing) + r.grazing;
  const Real mean = f0 + (Real(1) - f0) * Real(1.0f / 21.0f), lost = Real(1) - r.albedo;
  return {single, single * mean * lost / (Real(1) - mean * lost)};
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

  bool operator==(const Light&) const = default;
};

// Lights that may move: `open` at time 0, `close` at time 1, seen at time t. Without `close` they stand still.
struct Lights {
  std::span<const Light> open, close;
  float t = 0;

  std::size_t size() const { return open.size(); }
  Light at(std::size_t i) const { return close.empty() ? open[i] : moved(open[i], close[i]); }

 private:
  Light moved(const Light& from, const Light& to) const;
};

// Irradiance on a surface facing the light at `point` and the unit vector towards the light.
struct IncidentLight {
  Vec3 irradiance;
  Vec3 to_light;
};
IncidentLight incident_light(const Light& light, Vec3 point);

// Light leaving `point` towards `view`: emission, environment and all lights.
Vec3 shade_metallic_roughness(const MaterialPoint<float>& material, Vec3 point, Vec3 normal, Vec3 view,
                              const Lights& lights, const Environment& environment);

}  // namespace tessera::shaders
