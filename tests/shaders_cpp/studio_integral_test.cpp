// Surfaces with glTF's layers as the studio lights them, against integrals of their lobes in double precision: radiance
// from every direction times reflect_light(), which knows nothing of prefiltered light, fitted albedos or bent normals.
#include "base/vec.h"
#include "scene/material.h"
#include "shaders_cpp/environment.h"
#include "shaders_cpp/layered_material.h"
#include "tests/support/tests.h"

namespace tessera::shaders::studio_integral_test {
namespace {

using Vector = Vector3<float>;

struct Surface {
  std::string name;
  scene::EffectFlags flags;
  LayeredPoint<float> point;
  double worst;  // by how much shading may differ in any view, of a white surface's 1
};

// A dielectric of index 1.5.
LayeredPoint<float> dielectric(float albedo, float roughness) {
  LayeredPoint<float> m{};
  const auto grey = [](float x) { return Vector{x, x, x}; };
  m.diffuse = grey(albedo), m.f0 = m.f0_plain = grey(0.04f), m.f90 = m.f90_plain = 1;
  m.roughness = roughness, m.occlusion = 1, m.emissive = grey(0), m.ior = 1.5f;
  return m;
}

// An orthonormal base around a normal.
struct Frame {
  DVec3 normal, tangent, bitangent;

  explicit Frame(const DVec3& n) : normal(glm::normalize(n)) {
    tangent = glm::normalize(glm::cross(std::abs(normal.y) < 0.9 ? DVec3(0, 1, 0) : DVec3(1, 0, 0), normal));
    bitangent = glm::cross(normal, tangent);
  }
  DVec3 direction(double cosine, double turn) const {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return tangent * (sine * std::cos(turn)) + bitangent * (sine * std::sin(turn)) + normal * cosine;
  }
};
Vector vector(const DVec3& v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

// Light towards the view: the sum over rings around the mirrored direction, which are narrow where lobes are.
DVec3 integral(const scene::EffectFlags& flags, const LayeredPoint<float>& m, const Frame& frame, const DVec3& view) {
  const Environment studio;
  const Vector normal = vector(frame.normal), to_eye = vector(view);
  const LayerShares<float> shares = layer_shares(flags, m, to_eye, static_cast<float>(glm::dot(frame.normal, view)));
  const Frame mirror(frame.normal * (2 * glm::dot(frame.normal, view)) - view);
  constexpr int kRings = 120, kSectors = 160;
  DVec3 sum(0);
  for (int i = 0; i < kRings; ++i) {
    // angle = pi s^2
    const double s = (i + 0.5) / kRings, angle = std::numbers::pi * s * s, step = std::numbers::pi * 2 * s / kRings;
    for (int j = 0; j < kSectors; ++j) {
      const DVec3 light = mirror.direction(std::cos(angle), (j + 0.5) / kSectors * 2 * std::numbers::pi);
      if (glm::dot(light, frame.normal) <= 0) continue;
      const Vector returned = reflect_light(flags, m, shares, normal, to_eye, vector(light));
      const DVec3 arriving(studio.specular(Vec3(light), 0));
      sum += DVec3(returned.x, returned.y, returned.z) * arriving *
             (std::sin(angle) * step * 2 * std::numbers::pi / kSectors);
    }
  }
  return sum;
}

DVec3 shaded(const scene::EffectFlags& flags, LayeredPoint<float> m, const Frame& frame, const DVec3& view) {
  const auto nothing = [](std::size_t, const Vector&, const Vector&, float) { return Vector{0, 0, 0}; };
  const Vector out = shade_layered(flags, m, LayerConstants(), Vector{}, vector(frame.normal), vector(view), Lights(),
                                   0.0f, Environment(), nothing);
  return {out.x, out.y, out.z};
}

std::vector<Surface> surfaces(float roughness) {
  Surface white{"white", {}, dielectric(0.8f, roughness), 0.09}, black{"black", {}, dielectric(0, roughness), 0.025};
  Surface tinted = black, film = black, coat = black, brushed = black, sheen = black;
  tinted.name = "tinted", tinted.point.f0 = tinted.point.f0_plain = {0.16f, 0.08f, 0.02f};
  film.name = "film", film.flags.iridescence = true;
  film.point.iridescence = 1, film.point.film_ior = 1.3f, film.point.film_thickness = 400;
  coat.name = "coat", coat.flags.clearcoat = true, coat.point = dielectric(0.5f, 0.8f);
  coat.point.coat = 1, coat.point.coat_roughness = roughness;
  // Light on sheen is that on a diffuse surface.
  sheen.name = "sheen", sheen.flags.sheen = true, sheen.point = dielectric(0.2f, 0.8f), sheen.worst = 0.09;
  sheen.point.sheen = {0.8f, 0.6f, 0.4f}, sheen.point.sheen_roughness = roughness;
  // The lobe is a round one around a bent normal.
  brushed.name = "brushed", brushed.flags.anisotropy = true, brushed.point.anisotropy = 0.7f, brushed.worst = 0.12;
  return {white, black, tinted, film, coat, sheen, brushed};
}

struct Difference {
  double mean = 0, worst = 0;
};

// `shown`: the effects that are shaded in place of the surface's.
Difference difference(const Surface& surface, const scene::EffectFlags& shown) {
  Difference out;
  int views = 0;
  for (const DVec3& up : {DVec3(0, 0, 1), DVec3(0, 1, 0), DVec3(-0.55, 0.75, 0.65), DVec3(0.8, -0.2, 0.3)})
    for (const double cosine : {1.0, 0.7, 0.4})
      for (const double turn : {0.0, 2.0}) {
        const Frame frame(up);
        const DVec3 view = frame.direction(cosine, turn);
        LayeredPoint<float> m = surface.point;
        m.coat_normal = vector(frame.normal), m.tangent = vector(frame.tangent), m.bitangent = vector(frame.bitangent);
        const DVec3 seen = shaded(shown, m, frame, view);
        if (surface.flags.iridescence) add_film(m, static_cast<float>(cosine));
        const double error = std::abs(seen.y - integral(surface.flags, m, frame, view).y);
        out.mean += error, ++views;
        out.worst = std::max(out.worst, error);
      }
  out.mean /= views;
  return out;
}

TEST(StudioIntegral, ShadingOfEachLayerIsTheLobesIntegral) {
  for (const float roughness : {0.3f, 0.5f, 0.8f})
    for (const Surface& surface : surfaces(roughness)) {
      SCOPED_TRACE(surface.name + " of roughness " + std::to_string(roughness));
      const Difference seen = difference(surface, surface.flags);
      EXPECT_LT(seen.mean, 0.03);
      EXPECT_LT(seen.worst, surface.worst);
    }
}

// The twin: shading that forgets the layer.
TEST(StudioIntegral, AForgottenLayerIsSeen) {
  for (const Surface& surface : surfaces(0.3f))
    if (surface.flags.clearcoat || surface.flags.sheen) {
      SCOPED_TRACE(surface.name);
      EXPECT_GT(difference(surface, {}).mean, 1.5 * difference(surface, surface.flags).mean);
    }
}

}  // namespace
}  // namespace tessera::shaders::studio_integral_test
