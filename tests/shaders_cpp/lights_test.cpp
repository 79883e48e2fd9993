// KHR_lights_punctual against its formulas, written down again in double precision.
#include "scene/material.h"
#include "shaders_cpp/layered_material.h"
#include "shaders_cpp/metallic_roughness.h"
#include "tests/support/tests.h"

namespace tessera::shaders::lights_test {
namespace {

using Vector = Vector3<double>;

constexpr double kPiDouble = 3.14159265358979323846;
constexpr Vector kNormal{0, 0, 1};

// Light that arrives at a point of a surface that faces +z.
Incident<double> arriving(const Light& light, const Vector& point = {0, 0, 0}) {
  return incident<double>(light.type, light.range > 0, light_state<double>(light), point);
}

Light lamp(Light::Type type, double height, float intensity) {
  Light light;
  light.type = type;
  light.color = Vec3(intensity);
  light.position = {0, 0, static_cast<float>(height)};
  light.cos_inner = 1.0f, light.cos_outer = std::cos(0.7853981633974483f);
  return light;
}

// Radiance of a surface without reflections: a white Lambertian one.
double white_radiance(const Light& light, const Vector& point = {0, 0, 0}) {
  LayeredPoint<float> m{};
  m.diffuse = {1, 1, 1};  // f0 and f90 are 0
  m.roughness = m.occlusion = 1;
  const Vector3<float> up{0, 0, 1};
  const Incident<double> in = arriving(light, point);
  const Vector3<float> to_light{static_cast<float>(in.to_light.x), static_cast<float>(in.to_light.y),
                                static_cast<float>(in.to_light.z)};
  const scene::EffectFlags none;
  return static_cast<double>(reflect_light(none, m, layer_shares(none, m, up, 1.0f), up, up, to_light).x) *
         in.irradiance.x;
}

TEST(Lights, AWhiteSurfaceUnderOneLuxHasOneOverPiOfRadiance) {
  Light sun = lamp(Light::Type::kDirectional, 7, 3.0f);
  sun.direction = {0, 0, -1};
  EXPECT_NEAR(white_radiance(sun), 3 / kPiDouble, 1e-6);
  EXPECT_NEAR(white_radiance(sun, {40, -30, 5}), 3 / kPiDouble, 1e-6) << "wherever it is";
  const double slant = 1.1;
  sun.direction = Vec3(glm::dvec3(std::sin(slant), 0, -std::cos(slant)));
  EXPECT_NEAR(white_radiance(sun), 3 * std::cos(slant) / kPiDouble, 1e-6);
}

TEST(Lights, CandelaBecomeLuxByTheSquareOfTheDistance) {
  for (const double distance : {0.25, 1.0, 3.0, 250.0}) {
    const double lux = 8 / (distance * distance);
    EXPECT_NEAR(white_radiance(lamp(Light::Type::kPoint, distance, 8.0f)), lux / kPiDouble, 1e-6 * lux);
    EXPECT_NEAR(white_radiance(lamp(Light::Type::kSpot, distance, 8.0f)), lux / kPiDouble, 1e-6 * lux);
  }
  // From the side, at (3, 0, 4) above the point: the cosine is 4/5, the distance 5.
  EXPECT_NEAR(white_radiance(lamp(Light::Type::kPoint, 4, 8.0f), {-3, 0, 0}), 8.0 / 25 * 4 / 5 / kPiDouble, 1e-7);
}

// The whole material: at roughness 1 and normal incidence GGX is 1/pi, its visibility 1/4, Fresnel 0.04.
TEST(Lights, AWhiteDielectricReturnsItsClosedForm) {
  const MaterialPoint<double> white{{1, 1, 1}, 0, 1, 1, {}};
  EXPECT_NEAR(reflect_light(white, kNormal, kNormal, kNormal).x, (0.96 + 0.04 / 4) / kPiDouble, 1e-7);
}

TEST(Lights, ColourMultipliesAndChannelsAreApart) {
  Light light = lamp(Light::Type::kPoint, 2, 1.0f);
  light.color = {4, 0.5f, 0};
  const Vector irradiance = arriving(light).irradiance;
  EXPECT_DOUBLE_EQ(irradiance.x, 1);
  EXPECT_DOUBLE_EQ(irradiance.y, 0.125);
  EXPECT_EQ(irradiance.z, 0);
}

// KHR_lights_punctual, "Inner and Outer Cone Angles".
double angular_attenuation(double inner, double outer, double angle) {
  const double scale = 1 / std::max(0.001, std::cos(inner) - std::cos(outer)), offset = -std::cos(outer) * scale;
  const double share = std::clamp(std::cos(angle) * scale + offset, 0.0, 1.0);
  return share * share;
}

double spot_share(double inner, double outer, double angle) {
  Light spot = lamp(Light::Type::kSpot, 0, 1.0f);
  spot.cos_inner = static_cast<float>(std::cos(inner)), spot.cos_outer = static_cast<float>(std::cos(outer));
  return arriving(spot, {std::sin(angle), 0, -std::cos(angle)}).irradiance.x;  // at distance 1, it shines down
}

TEST(Lights, SpotsFadeBetweenTheirConesAsTheExtensionSays) {
  struct Cones {
    double inner, outer;
  };
  for (const Cones& cones : {Cones{0, kPiDouble / 4}, {0.2, 0.6}, {0, kPiDouble / 2}, {1.2, kPiDouble / 2}}) {
    for (int i = 0; i <= 64; ++i) {
      const double angle = kPiDouble * i / 64;
      EXPECT_NEAR(spot_share(cones.inner, cones.outer, angle), angular_attenuation(cones.inner, cones.outer, angle),
                  1e-5)
          << cones.inner << " " << cones.outer << " " << angle;
    }
    EXPECT_NEAR(spot_share(cones.inner, cones.outer, cones.inner), 1, 1e-5);
    EXPECT_NEAR(spot_share(cones.inner, cones.outer, cones.outer), 0, 1e-9);
    const double middle = std::acos((std::cos(cones.inner) + std::cos(cones.outer)) / 2);
    EXPECT_NEAR(spot_share(cones.inner, cones.outer, middle), 0.25, 1e-5) << "squared";
  }
}

// The extension bounds the slope: the edge of cones that nearly touch is 0.001 of the cosine wide.
TEST(Lights, ConesThatNearlyTouchHaveAnEdgeOfFiniteWidth) {
  const double outer = 0.6, inner = outer - 1e-4;
  for (const double cosine : {0.0, 0.00025, 0.0005, 0.00099, 0.0011, 0.01}) {
    const double angle = std::acos(std::cos(outer) + cosine);
    EXPECT_NEAR(spot_share(inner, outer, angle), angular_attenuation(inner, outer, angle), 2e-4) << cosine;
  }
  EXPECT_NEAR(spot_share(inner, outer, std::acos(std::cos(outer) + 0.0005)), 0.25, 2e-4);
}

// KHR_lights_punctual, "Range Property": the window ends at the range and is nearly 1 within half of it.
TEST(Lights, RangeIsAWindowOnTheFallOff) {
  Light light = lamp(Light::Type::kPoint, 0, 5.0f);
  light.range = 4;
  for (const double distance : {0.5, 1.0, 2.0, 3.0, 3.9, 4.0, 4.1, 40.0}) {
    const double ratio = distance / 4;
    const double window = std::max(std::min(1 - ratio * ratio * ratio * ratio, 1.0), 0.0);
    EXPECT_NEAR(arriving(light, {0, distance, 0}).irradiance.x, 5 * window / (distance * distance), 1e-6) << distance;
    light.type = Light::Type::kSpot;
    EXPECT_NEAR(arriving(light, {0, 0, -distance}).irradiance.x, 5 * window / (distance * distance), 1e-6) << distance;
    light.type = Light::Type::kPoint;
  }
  light.range = 0;  // unlimited
  EXPECT_NEAR(arriving(light, {0, 40, 0}).irradiance.x, 5 / 1600.0, 1e-9);
  light.type = Light::Type::kDirectional;
  light.range = 4;
  EXPECT_EQ(arriving(light, {0, 40, 0}).irradiance.x, 5.0) << "a directional light has none";
}

}  // namespace
}  // namespace tessera::shaders::lights_test
