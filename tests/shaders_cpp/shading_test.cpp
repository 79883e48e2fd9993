#include "shaders_cpp/environment.h"
#include "shaders_cpp/metallic_roughness.h"
#include "shaders_cpp/studio.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/tests.h"

namespace tessera::shaders::shading_test {
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

Incident<float> incident_light(const Light& light, Vec3 point) {
  return incident<float>(light.type, light.range > 0, light_state<float>(light), {point.x, point.y, point.z});
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
  const Vector3<float> up = incident_light(sun, {9, 9, 9}).to_light;
  EXPECT_EQ(Vec3(up.x, up.y, up.z), Vec3(0, 1, 0));
}

// ---- The environment behind rough surfaces ----------------------------------------------------------------------

// The studio itself, in double precision, from its parts in studio.h.
DVec3 studio(const DVec3& direction) {
  const double ceiling = ceiling_share(direction.y, static_cast<double>(kHorizon));
  DVec3 sum = DVec3(kFloor) * (1 - ceiling) + DVec3(kCeiling) * ceiling;
  for (const SoftBox& box : kSoftBoxes)
    sum += DVec3(box.amplitude) *
           std::exp(static_cast<double>(box.sharpness) * (glm::dot(glm::normalize(DVec3(box.axis)), direction) - 1));
  return sum;
}

DVec3 wide(const Vec3& v) { return DVec3(v); }
double mean(const DVec3& v) { return (v.x + v.y + v.z) / 3; }

// Directions of a (0,2)-sequence's points.
struct Halton {
  std::uint32_t i = 0;
  glm::dvec2 next() {
    ++i;
    const auto radical = [&](std::uint32_t base) {
      double out = 0, digit = 1;
      for (std::uint32_t n = i; n > 0; n /= base) out += (digit /= base) * (n % base);
      return out;
    };
    return {radical(2), radical(3)};
  }
};

std::array<DVec3, 2> tangents(const DVec3& n) {
  const DVec3 t = glm::normalize(glm::cross(n, std::abs(n.x) < 0.9 ? DVec3(1, 0, 0) : DVec3(0, 1, 0)));
  return {t, glm::cross(n, t)};
}

TEST(Environment, IsItsIntegralOverTheLobeAtEveryRoughness) {
  test::Random random(2);
  const Environment environment;
  for (const double roughness : {0.0, 0.1, 0.2, 0.33, 0.45, 0.6, 0.72, 0.85, 1.0})
    for (int trial = 0; trial < 12; ++trial) {
      const DVec3 n = glm::normalize(wide(random.in_box(1)) + DVec3(0, 0, 1e-3));
      const auto [t, b] = tangents(n);
      const double alpha = roughness * roughness;
      DVec3 sum(0.0), diffuse(0.0);
      double weight = 0;
      Halton points;
      for (int k = 0; k < 20000; ++k) {
        const glm::dvec2 u = points.next();
        const double c = std::sqrt((1 - u.x) / (1 + (alpha * alpha - 1) * u.x)),
                     s = std::sqrt(std::max(1 - c * c, 0.0));
        const DVec3 half = t * (s * std::cos(kTwoPi * u.y)) + b * (s * std::sin(kTwoPi * u.y)) + n * c;
        const DVec3 light = half * (2 * c) - n;
        const double cosine = std::max(glm::dot(light, n), 0.0);
        const double shadowing =
            2 * cosine / (cosine + std::sqrt(cosine * cosine * (1 - alpha * alpha) + alpha * alpha));
        sum += studio(light) * shadowing;
        weight += shadowing;
        const double sine = std::sqrt(u.x);
        diffuse +=
            studio(t * (sine * std::cos(kTwoPi * u.y)) + b * (sine * std::sin(kTwoPi * u.y)) + n * std::sqrt(1 - u.x)) /
            20000.0;
      }
      const DVec3 exact = sum / weight, fitted = wide(environment.specular(Vec3(n), static_cast<float>(roughness)));
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(fitted[c], exact[c], 0.02 + 0.015 * exact[c]) << roughness;
      EXPECT_NEAR(mean(wide(environment.diffuse(Vec3(n)))), mean(diffuse), 0.02 + 0.01 * mean(diffuse));
    }
}

TEST(Environment, WhiteLosesNothingInAUniformOne) {
  // A white furnace: the returned light is the shares' sum, for any roughness and view.
  for (float roughness = 0; roughness <= 1; roughness += 0.05f)
    for (float n_v = 0.02f; n_v <= 1; n_v += 0.02f) {
      const EnvironmentReflectance<float> r = environment_reflectance(roughness, n_v);
      const EnvironmentShares<float> metal = environment_shares(r, 1.0f), coat = environment_shares(r, 0.04f);
      EXPECT_NEAR(metal.single + metal.multiple, 1.0f, 1e-5f) << roughness << " " << n_v;
      EXPECT_GE(coat.single, 0.0f);
      EXPECT_LE(coat.single + coat.multiple, 1.0f) << "the rest is scattered below";
    }
}

TEST(Environment, ReflectanceIsTheIntegralOfTheBrdf) {
  double worst = 0, squares = 0;
  int count = 0;
  for (double roughness = 0.3; roughness <= 1; roughness += 0.1)
    for (double angle = 0; angle < 1.35; angle += 0.15) {
      const EnvironmentReflectance<double> r = environment_reflectance(roughness, std::cos(angle));
      const double error = r.albedo - albedo(material(1, roughness), angle);
      worst = std::max(worst, std::abs(error));
      squares += error * error;
      ++count;
    }
  EXPECT_LT(worst, 0.035);
  EXPECT_LT(std::sqrt(squares / count), 0.012);
}

// Light of the studio that white microfacets return towards a viewer, by random walks between them: the Smith model
// of a GGX surface, every reflection followed (Heitz et al. 2016; visible normals by Dupuy and Benyoub 2023). The
// shader's shares approximate this walk and share no code with it.
class MicrofacetWalk {
 public:
  MicrofacetWalk(double roughness, std::uint32_t seed) : alpha_(roughness * roughness), random_(seed) {}

  DVec3 radiance(const DVec3& normal, const DVec3& view) {
    const auto [t, b] = tangents(normal);
    DVec3 w(-glm::dot(view, t), -glm::dot(view, b), -glm::dot(view, normal));
    double height = 1;  // heights are uniform in [-1, 1]
    for (int bounce = 0; bounce < 200; ++bounce) {
      if (escapes(w, height)) return studio(t * w.x + b * w.y + normal * w.z);
      const DVec3 facet = visible_normal(-w);
      w = w - facet * (2 * glm::dot(w, facet));
    }
    return DVec3(0.0);
  }

 private:
  double uniform() { return static_cast<double>(random_.uniform(0, 0.9999999f)); }

  // Walks to the next facet; true where there is none.
  bool escapes(const DVec3& w, double& height) {
    const double below = std::clamp(0.5 * (height + 1), 0.0, 1.0), u = uniform();
    if (w.z > 0.9999) return true;
    if (w.z < -0.9999) {
      height = 2 * u * below - 1;
      return false;
    }
    const double sine = std::sqrt(1 - w.z * w.z), a = w.z / (alpha_ * sine);
    const double lambda = 0.5 * (-1 + (a > 0 ? 1 : -1) * std::sqrt(1 + 1 / (a * a)));
    if (w.z > 0 && u > 1 - std::pow(below, lambda)) return true;
    height = 2 * std::clamp(below / std::pow(1 - u, 1 / lambda), 0.0, 1.0) - 1;
    return false;
  }

  DVec3 visible_normal(const DVec3& towards) {
    const DVec3 s = glm::normalize(DVec3(towards.x * alpha_, towards.y * alpha_, towards.z));
    const double z = (1 - uniform()) * (1 + s.z) - s.z, r = std::sqrt(std::clamp(1 - z * z, 0.0, 1.0)),
                 phi = kTwoPi * uniform();
    const DVec3 h = DVec3(r * std::cos(phi), r * std::sin(phi), z) + s;
    return glm::normalize(DVec3(h.x * alpha_, h.y * alpha_, std::max(h.z, 0.0)));
  }

  double alpha_;
  test::Random random_;
};

TEST(Environment, WhiteMetalIsAsBrightAsRandomWalksBetweenItsFacets) {
  // Mean over the image of a sphere seen from far away, and its middle.
  const DVec3 view(0, 0, 1);
  for (const double roughness : {0.2, 0.4, 0.6, 0.8, 1.0}) {
    const MaterialPoint<float> white{{1, 1, 1}, 1, static_cast<float>(roughness), 1, {}};
    const auto shaded = [&](const DVec3& normal) {
      const auto plain = [](const DVec3& a) {
        return Vector3<float>{static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
      };
      const Vector3<float> light = shade_material(white, {}, plain(normal), plain(view), {}, 0.0f, Environment());
      return mean(DVec3(light.x, light.y, light.z));
    };
    MicrofacetWalk walk(roughness, 7);
    double sphere = 0, ours = 0, middle = 0;
    constexpr int kNormals = 4000, kWalks = 40, kMiddle = 60000;
    Halton points;
    for (int k = 0; k < kNormals; ++k) {
      const glm::dvec2 u = points.next();
      const double r = std::sqrt(u.x);
      const DVec3 normal(r * std::cos(kTwoPi * u.y), r * std::sin(kTwoPi * u.y), std::sqrt(1 - u.x));
      for (int i = 0; i < kWalks; ++i) sphere += mean(walk.radiance(normal, view)) / kWalks;
      ours += shaded(normal);
    }
    for (int k = 0; k < kMiddle; ++k) middle += mean(walk.radiance(view, view)) / kMiddle;
    EXPECT_NEAR(ours / sphere, 1, 0.02) << roughness;
    EXPECT_NEAR(shaded(view) / middle, 1, 0.02) << roughness;
    std::printf("roughness %.1f: sphere %.3f of %.3f (%+.1f %%), middle %.3f of %.3f (%+.1f %%)\n", roughness,
                ours / kNormals, sphere / kNormals, 100 * (ours / sphere - 1), shaded(view), middle,
                100 * (shaded(view) / middle - 1));
  }
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
}  // namespace tessera::shaders::shading_test
