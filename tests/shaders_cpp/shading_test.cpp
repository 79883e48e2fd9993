#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "shaders_cpp/environment.h"
#include "shaders_cpp/metallic_roughness.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/captures.h"

namespace tessera::shaders {
namespace {

constexpr double kTwoPi = 6.283185307179586;

MaterialPoint<double> material(double metallic, double roughness, double color = 1.0) {
  return {{color, color, color}, metallic, roughness, 1.0, {}};
}

// Integral of BRDF times cosine over the hemisphere, by a fine grid in the projected disc.
double albedo(const MaterialPoint<double>& m, double view_angle) {
  const Vector3<double> normal{0, 0, 1}, view{std::sin(view_angle), 0, std::cos(view_angle)};
  double sum = 0;
  const int rings = 400, slices = 256;
  for (int i = 0; i < rings; ++i) {
    const double theta = (i + 0.5) / rings * kTwoPi / 4,
                 weight = std::sin(theta) * kTwoPi / 4 / rings * kTwoPi / slices;
    for (int j = 0; j < slices; ++j) {
      const double phi = (j + 0.5) / slices * kTwoPi;
      sum += reflect_light(m, normal, view,
                           {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)})
                 .x *
             weight;
    }
  }
  return sum;
}

TEST(MetallicRoughness, ReflectsNoMoreLightThanItReceivesAwayFromGrazingViews) {
  for (const double metallic : {0.0, 1.0})
    for (const double roughness : {0.3, 0.6, 1.0})
      for (const double angle : {0.0, 0.4, 0.8})
        EXPECT_LE(albedo(material(metallic, roughness), angle), 1.01) << metallic << " " << roughness << " " << angle;
  // At grazing views glTF's sum of a diffuse and a specular lobe exceeds 1 for dielectrics; metals stay below.
  EXPECT_LE(albedo(material(1, 0.3), 1.3), 1.01);
}

TEST(MetallicRoughness, AWhiteRoughDielectricReflectsNearlyAllFromTheFront) {
  EXPECT_NEAR(albedo(material(0, 1), 0.0), 0.97, 0.04);
}

TEST(MetallicRoughness, IsReciprocal) {
  test::Random random(3);
  for (int i = 0; i < 500; ++i) {
    const auto direction = [&] {
      Vec3 d = random.in_box(1);
      d.z = std::abs(d.z) + 0.05f;
      d = glm::normalize(d);
      return Vector3<double>{static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z)};
    };
    const auto a = direction(), b = direction();
    const auto m =
        material(static_cast<double>(random.uniform(0, 1)), static_cast<double>(random.uniform(0.1f, 1)), 0.6);
    const Vector3<double> normal{0, 0, 1};
    // BRDF = value / cosine of the light.
    // The directions are unit vectors to single precision only.
    const double forth = reflect_light(m, normal, a, b).y / b.z, back = reflect_light(m, normal, b, a).y / a.z;
    EXPECT_NEAR(forth, back, 1e-5 * forth);
  }
}

TEST(MetallicRoughness, LightFromBelowTheHorizonGivesNothing) {
  const auto out = reflect_light(material(0.5, 0.5), Vector3<double>{0, 0, 1}, Vector3<double>{0, 0, 1},
                                 Vector3<double>{0.6, 0, -0.8});
  EXPECT_EQ(out.x, 0.0);
}

TEST(MetallicRoughness, FloatFollowsDouble) {
  test::Random random(9);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 light = glm::normalize(random.in_box(1) + Vec3(0, 0, 1.2f)),
               view = glm::normalize(random.in_box(1) + Vec3(0, 0, 1.2f));
    const float metallic = random.uniform(0, 1), roughness = random.uniform(0.2f, 1);
    const MaterialPoint<float> m{{0.7f, 0.5f, 0.3f}, metallic, roughness, 1, {}};
    const MaterialPoint<double> d{
        {0.7, 0.5, 0.3}, static_cast<double>(metallic), static_cast<double>(roughness), 1, {}};
    const auto wide = [](const Vec3& v) {
      return Vector3<double>{static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
    };
    const float f = reflect_light(m, Vector3<float>{0, 0, 1}, Vector3<float>{view.x, view.y, view.z},
                                  Vector3<float>{light.x, light.y, light.z})
                        .x;
    const double g = reflect_light(d, Vector3<double>{0, 0, 1}, wide(view), wide(light)).x;
    EXPECT_NEAR(static_cast<double>(f), g, 1e-4 * (1 + g));
  }
}

TEST(Lights, AttenuateAsKhrLightsPunctualSays) {
  Light point;
  point.type = Light::Type::kPoint;
  point.position = {0, 3, 0};
  EXPECT_NEAR(incident_light(point, {0, 1, 0}).irradiance.x, 0.25f, 1e-6f);
  point.range = 2.0f;
  EXPECT_FLOAT_EQ(incident_light(point, {0, 1, 0}).irradiance.x, 0.0f);  // at the range
  EXPECT_NEAR(incident_light(point, {0, 2, 0}).irradiance.x, 1.0f - 1.0f / 16.0f, 1e-6f);
  Light spot = point;
  spot.type = Light::Type::kSpot;
  spot.range = 0;
  spot.direction = {0, -1, 0};
  spot.cos_inner = 0.9f;
  spot.cos_outer = 0.7f;
  EXPECT_NEAR(incident_light(spot, {0, 2, 0}).irradiance.x, 1.0f, 1e-6f);
  EXPECT_FLOAT_EQ(incident_light(spot, {5, 2.5f, 0}).irradiance.x, 0.0f);
  Light sun;
  sun.direction = {0, -1, 0};
  EXPECT_EQ(incident_light(sun, {9, 9, 9}).to_light, Vec3(0, 1, 0));
}

TEST(Environment, IsPositiveFiniteAndBrighterFromAboveThanFromBelow) {
  const Environment environment;
  for (const float roughness : {0.0f, 0.5f, 1.0f}) {
    const Vec3 up = environment.specular({0, 1, 0}, roughness), down = environment.specular({0, -1, 0}, roughness);
    EXPECT_GT(up.x, down.x);
    EXPECT_GT(down.x, 0.0f);
  }
  EXPECT_GT(environment.diffuse({0, 1, 0}).x, environment.diffuse({0, -1, 0}).x);
  EXPECT_EQ(Environment(0.0f).specular({0, 1, 0}, 0.3f), Vec3(0.0f));
}

TEST(ToneMap, IsMonotoneAndBoundedAndKeepsModestColours) {
  float last = -1;
  for (float grey = 0.0f; grey < 50.0f; grey = grey * 1.1f + 0.01f) {
    const float mapped = tone_map(Vec3(grey)).x;
    EXPECT_GE(mapped, last);
    EXPECT_LE(mapped, 1.0f);
    last = mapped;
  }
  // Khronos PBR Neutral subtracts 0.04 (the reflectance of a dielectric) and leaves hue and value below 0.8.
  const Vec3 color = tone_map({0.5f, 0.3f, 0.2f});
  EXPECT_NEAR(color.x, 0.46f, 1e-5f);
  EXPECT_NEAR(color.z, 0.16f, 1e-5f);
}

TEST(ToneMap, SwallowsNanNegativeAndInfiniteLight) {
  const float infinity = std::numeric_limits<float>::infinity();
  for (const Vec3& odd : {Vec3(std::nanf("")), Vec3(-1.0f), Vec3(infinity), Vec3(infinity, 0, -infinity)}) {
    const Vec3 mapped = tone_map(odd);
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(mapped[c] >= 0.0f && mapped[c] <= 1.0f);
  }
  Image image(1, 1, 4);
  image.values = {std::nanf(""), 1e30f, -3.0f, 1.0f};
  EXPECT_NO_THROW(to_display(image, 1.0f));
}

}  // namespace
}  // namespace tessera::shaders
