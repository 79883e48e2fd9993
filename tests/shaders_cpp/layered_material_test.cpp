// Layers of glTF's material extensions against closed forms, integrals in double precision and the furnace.
#include <random>

#include "scene/material.h"
#include "shaders_cpp/environment.h"
#include "shaders_cpp/layered_material.h"
#include "tests/support/tests.h"

namespace tessera::shaders::layered_material_test {
namespace {

using Vector = Vector3<float>;

constexpr Vector kUp{0, 0, 1};
constexpr double kPiDouble = 3.14159265358979323846;

class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : engine_(seed) {}
  float unit() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  bool coin() { return (engine_() & 1) != 0; }

 private:
  std::mt19937 engine_;
};

Vector grey(float x) { return {x, x, x}; }
Vector at_angle(float cosine, float turn = 0) {
  const float sine = std::sqrt(std::max(0.0f, 1 - cosine * cosine));
  return {sine * std::cos(turn), sine * std::sin(turn), cosine};
}

// A dielectric of index 1.5, white below.
LayeredPoint<float> white_point(float roughness) {
  LayeredPoint<float> m{};
  m.diffuse = grey(1), m.f0 = m.f0_plain = grey(0.04f), m.f90 = m.f90_plain = 1;
  m.roughness = roughness, m.occlusion = 1, m.emissive = grey(0);
  m.coat_normal = kUp, m.tangent = {1, 0, 0}, m.bitangent = {0, 1, 0}, m.ior = 1.5f;
  return m;
}
LayeredPoint<float> metal_point(float roughness) {
  LayeredPoint<float> m = white_point(roughness);
  m.metallic = 1, m.f0 = grey(1), m.f90 = 1;
  return m;
}

Environment furnace() { return Environment(Surroundings{Surroundings::Kind::kUniform, 1.0f}); }

// `light`: all that arrives from behind.
Vector in_furnace(const scene::EffectFlags& flags, LayeredPoint<float> m, float cosine,
                  const LayerConstants& constants = {}) {
  const auto behind = [](std::size_t, const Vector&, const Vector&, float) { return grey(1); };
  return shade_layered(flags, m, constants, Vector{}, kUp, at_angle(cosine), Lights(), 0.0f, furnace(), behind);
}

constexpr std::array<float, 8> kRoughness = {0, 0.1f, 0.2f, 0.35f, 0.5f, 0.65f, 0.8f, 1};
constexpr std::array<float, 7> kCosines = {0.02f, 0.1f, 0.25f, 0.5f, 0.75f, 0.9f, 1};

void for_each_view(const std::function<void(float roughness, float cosine)>& check) {
  for (const float r : kRoughness)
    for (const float c : kCosines) check(r, c);
}

// ---- LAYER1 --------------------------------------------------------------------------------------------------------

TEST(LayeredMaterial, WithoutEffectsItIsThePlainMaterial) {
  Numbers random(7);
  for (int n = 0; n < 2000; ++n) {
    MaterialPoint<float> plain;
    plain.base_color = {random.unit(), random.unit(), random.unit()};
    plain.metallic = random.coin() ? 1.0f : 0.0f;
    plain.roughness = random.unit(), plain.occlusion = random.unit(), plain.emissive = grey(random.unit());
    LayeredPoint<float> m = white_point(plain.roughness);
    m.diffuse = plain.base_color, m.metallic = plain.metallic, m.occlusion = plain.occlusion;
    m.emissive = plain.emissive;
    m.f0 = grey(0.04f * (1 - m.metallic)) + plain.base_color * m.metallic;
    const Vector view = at_angle(0.05f + 0.95f * random.unit(), 6 * random.unit());
    Light light;
    light.color = Vec3(2.0f), light.direction = glm::normalize(Vec3(random.unit() - 0.5f, random.unit() - 0.5f, -0.7f));
    const Lights lights{std::span(&light, 1), {}, 0};
    const Environment studio;
    const auto nothing = [](std::size_t, const Vector&, const Vector&, float) { return grey(0); };
    const Vector a = shade_layered(scene::EffectFlags(), m, LayerConstants(), Vector{}, kUp, view, lights, 0.0f, studio,
                                   nothing),
                 b = shade_material(plain, Vector{}, kUp, view, lights, 0.0f, studio);
    for (const auto& [x, y] : {std::pair{a.x, b.x}, {a.y, b.y}, {a.z, b.z}}) EXPECT_NEAR(x, y, 2e-5f * (1 + y));
  }
}

// ---- LAYER2: the white furnace -------------------------------------------------------------------------------------

TEST(LayeredMaterial, WhiteMetalAndWhiteDielectricKeepAllLight) {
  for_each_view([](float r, float c) {
    EXPECT_NEAR(in_furnace({}, metal_point(r), c).x, 1.0f, 0.02f) << r << ' ' << c;
    EXPECT_NEAR(in_furnace({}, white_point(r), c).x, 1.0f, 0.02f) << r << ' ' << c;
  });
}

TEST(LayeredMaterial, LayersKeepNearlyAllLight) {
  for_each_view([](float r, float c) {
    bool metal = false;
    const auto expect_kept = [&](const scene::EffectFlags& flags, const LayeredPoint<float>& m, const char* what) {
      // A tint enters as its brightest channel does.
      const float kept = largest(in_furnace(flags, m, c));
      EXPECT_GE(kept, 0.9f) << what << (metal ? " metal" : "") << ' ' << r << ' ' << c;
      EXPECT_LE(kept, 1.02f) << what << ' ' << r << ' ' << c;
    };
    for (const bool is_metal : {false, true}) {
      metal = is_metal;
      LayeredPoint<float> m = metal ? metal_point(r) : white_point(r);
      m.coat = 1, m.coat_roughness = r;
      expect_kept({.clearcoat = true}, m, "coat");
      m.sheen = grey(1), m.sheen_roughness = std::max(r, 0.1f);
      expect_kept({.sheen = true}, m, "sheen");
      m.anisotropy = 0.8f;
      expect_kept({.anisotropy = true}, m, "anisotropy");
      m.transmission = 0.7f, m.thickness = 0.2f, m.spread = 0.5f, m.spread_color = grey(1);
      expect_kept({.transmission = true, .volume = true}, m, "volume");
      expect_kept({.diffuse_transmission = true}, m, "spread");
      m.iridescence = 1, m.film_ior = 1.3f, m.film_thickness = 400 * r;
      expect_kept({.iridescence = !metal}, m, "film");
      expect_kept({.clearcoat = true, .sheen = true, .transmission = true, .diffuse_transmission = true}, m, "all");
    }
  });
}

// The broken twin: a coat that does not dim the layers below returns more light than arrives.
TEST(LayeredMaterial, TheFurnaceSeesACoatThatTakesNothing) {
  LayeredPoint<float> m = white_point(0.3f);
  m.coat = 1;
  const auto behind = [](std::size_t, const Vector&, const Vector&, float) { return grey(1); };
  const LayerShares<float> none{0, 0, 1};
  const LayerShares<float> coat = layer_shares(scene::EffectFlags{.clearcoat = true}, m, at_angle(0.1f), 0.1f);
  const Vector out =
      shade_layers_by_environment(scene::EffectFlags{.clearcoat = true}, m, {coat.coat, none.sheen, none.below},
                                  LayerConstants(), kUp, at_angle(0.1f), furnace(), behind);
  EXPECT_GT(out.x, 1.02f);
}

// ---- Closed forms -----------------------------------------------------------------------------------------------

// Fresnel's equations for unpolarised light: Schlick's approximation is exact head-on and at grazing angles.
double exact_fresnel(double ior, double cosine) {
  const double sine2 = (1 - cosine * cosine) / (ior * ior), inside = std::sqrt(1 - sine2);
  const double s = (cosine - ior * inside) / (cosine + ior * inside),
               p = (ior * cosine - inside) / (ior * cosine + inside);
  return 0.5 * (s * s + p * p);
}

TEST(LayeredMaterial, ReflectanceFollowsTheIndexOfRefraction) {
  for (const double ior : {1.33, 1.5, 1.8, 2.4}) {
    const double f0 = std::pow((ior - 1) / (ior + 1), 2);
    EXPECT_NEAR(exact_fresnel(ior, 1), f0, 1e-12);
    for (const double cosine : {1.0, 0.9, 0.7, 0.5, 0.3, 0.0})
      EXPECT_NEAR(static_cast<double>(fresnel(static_cast<float>(f0), 1.0f, static_cast<float>(cosine))),
                  exact_fresnel(ior, cosine), cosine == 1.0 || cosine == 0.0 ? 1e-6 : 0.045)
          << ior << ' ' << cosine;
  }
}

TEST(LayeredMaterial, VolumesFollowBeersLaw) {
  const Vec3 color(0.25f, 0.5f, 0.9f);
  const float distance = 0.35f;
  const Vec3 absorption = -glm::log2(color) / distance;
  for (const float way : {0.0f, 0.1f, 0.35f, 0.7f, 3.5f}) {
    const Vector through = transmittance(absorption, way);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR((std::array{through.x, through.y, through.z}[static_cast<std::size_t>(c)]),
                  std::pow(color[c], way / distance), 2e-6f)
          << way;
  }
  LayeredPoint<float> m = white_point(0);
  m.transmission = 1, m.thickness = 2 * distance, m.f0_plain = m.f0 = grey(0), m.f90 = m.f90_plain = 0;
  const scene::EffectFlags flags{.transmission = true, .volume = true};
  const Vector seen = in_furnace(flags, m, 0.4f, {absorption, 0});
  EXPECT_NEAR(seen.x, 0.0625f, 1e-5f);
  EXPECT_NEAR(seen.y, 0.25f, 1e-5f);
}

TEST(LayeredMaterial, RaysRefractBySnellsLaw) {
  for (const float ior : {1.0f, 1.1f, 1.5f, 2.4f})
    for (const float cosine : kCosines) {
      const Vector view = at_angle(cosine), way = refracted(kUp, view, ior);
      EXPECT_NEAR(dot(way, way), 1.0f, 1e-5f);
      EXPECT_NEAR(std::hypot(way.x, way.y) * ior, std::hypot(view.x, view.y), 2e-6f);
      EXPECT_LT(way.z, 0.0f);
      EXPECT_LE(way.x, 0.0f);  // on the other side of the normal
    }
}

TEST(LayeredMaterial, ACoatAtGrazingAnglesIsAMirror) {
  LayeredPoint<float> m = white_point(1);
  m.diffuse = grey(0.2f), m.coat = 1, m.coat_roughness = 0;
  const float head_on = layer_shares(scene::EffectFlags{.clearcoat = true}, m, kUp, 1.0f).coat,
              grazing = layer_shares(scene::EffectFlags{.clearcoat = true}, m, at_angle(0), 0.0f).coat;
  EXPECT_NEAR(head_on, 0.04f, 0.005f);
  EXPECT_NEAR(grazing, 1.0f, 0.07f);
  EXPECT_LT(layer_shares(scene::EffectFlags{.clearcoat = true}, m, at_angle(0), 0.0f).below, 0.07f);
}

TEST(LayeredMaterial, DispersionSpreadsIndicesAroundTheMaterials) {
  LayeredPoint<float> m = white_point(0);
  m.transmission = 1, m.thickness = 1;
  std::vector<float> indices;
  const auto behind = [&](std::size_t, const Vector&, const Vector& direction, float) {
    indices.push_back(std::hypot(at_angle(0.5f).x, at_angle(0.5f).y) / std::hypot(direction.x, direction.y));
    return grey(1);
  };
  const scene::EffectFlags flags{.transmission = true, .volume = true, .dispersion = true};
  // An Abbe number of 20 / 0.5: n_F - n_C = (n - 1) / 40.
  transmitted(flags, m, LayerConstants{Vec3(0.0f), 0.5f}, kUp, at_angle(0.5f), behind);
  ASSERT_EQ(indices.size(), 3u);
  EXPECT_NEAR(indices[1], 1.5f, 1e-4f);
  EXPECT_NEAR(indices[2] - indices[0], 0.5f / 40, 1e-4f);
}

// ---- Thin films -------------------------------------------------------------------------------------------------

TEST(LayeredMaterial, AFilmOfNoThicknessIsNotThere) {
  for (const float f0 : {0.02f, 0.04f, 0.3f, 0.9f})
    for (const float cosine : kCosines) {
      const Vector film = film_fresnel(grey(f0), 1.4f, 0.0f, cosine);
      EXPECT_NEAR(film.x, fresnel(f0, 1.0f, cosine), 0.012f);
      EXPECT_NEAR(film.y, fresnel(f0, 1.0f, cosine), 0.012f);
    }
}

// A film between air and a base, wave by wave: Airy's sum, its amplitudes Schlick's, seen through the same
// sensitivities.
Vector airy(double f0, double ior, double thickness, double cosine) {
  const double cos2 = std::sqrt(1 - (1 - cosine * cosine) / (ior * ior));
  const auto schlick = [](double f, double c) { return f + (1 - f) * std::pow(1 - c, 5); };
  const double r12 = exact_fresnel(ior, cosine);
  const double base = (1 + std::sqrt(f0)) / (1 - std::sqrt(f0)), p = (base - ior) / (base + ior),
               r23 = schlick(p * p, cos2);
  const double t = 1 - r12, r = std::sqrt(r12 * r23), shift = kPiDouble + (base < ior ? kPiDouble : 0);
  const double path = 2 * ior * thickness * cos2;
  const double several = t * t * r23 / (1 - r * r);
  std::array<double, 3> sum = {r12 + several, r12 + several, r12 + several};
  double wave = several - t;
  for (int m = 1; m <= 40; ++m) {
    wave *= r;
    const float phase = static_cast<float>(std::fmod(m * shift, 2 * kPiDouble));
    const Vector seen = film_sensitivity(static_cast<float>(m * path), Vector{phase, phase, phase});
    sum[0] += 2 * wave * static_cast<double>(seen.x), sum[1] += 2 * wave * static_cast<double>(seen.y),
        sum[2] += 2 * wave * static_cast<double>(seen.z);
  }
  const auto unit = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {unit(sum[0]), unit(sum[1]), unit(sum[2])};
}

TEST(LayeredMaterial, TwoTermsOfAFilmsSeriesAreEnough) {
  double worst = 0, sum = 0;
  int count = 0;
  for (const float f0 : {0.04f, 0.5f, 0.95f})
    for (const float ior : {1.3f, 1.8f})
      for (float thickness = 50; thickness <= 800; thickness += 50)
        for (const float cosine : {0.3f, 0.6f, 1.0f}) {
          const Vector two = film_fresnel(grey(f0), ior, thickness, cosine),
                       all = airy(static_cast<double>(f0), static_cast<double>(ior), static_cast<double>(thickness),
                                  static_cast<double>(cosine));
          for (const float error : {two.x - all.x, two.y - all.y, two.z - all.z}) {
            worst = std::max(worst, static_cast<double>(std::abs(error)));
            sum += static_cast<double>(std::abs(error));
            ++count;
          }
        }
  EXPECT_LT(sum / count, 0.004);
  EXPECT_LT(worst, 0.06);
}

// Colours of a film repeat along its thickness: a quarter of a wave apart green is dark and bright.
TEST(LayeredMaterial, FilmsInterfere) {
  // Soap: reflections from both sides are opposite; half a wave more of path turns dark into bright.
  const float dark = film_fresnel(grey(0.0f), 1.33f, 550.0f / (2 * 1.33f), 1.0f).y,
              bright = film_fresnel(grey(0.0f), 1.33f, 550.0f / (4 * 1.33f), 1.0f).y;
  EXPECT_GT(bright, 4 * dark);
}

TEST(LayeredMaterial, FilmsTakeF0BackFromTheirReflectance) {
  for (const float f0 : {0.0f, 0.04f, 0.5f, 1.0f})
    for (const float cosine : {0.1f, 0.3f, 0.7f, 1.0f})
      EXPECT_NEAR(f0_of(fresnel(f0, 1.0f, cosine), cosine), f0, 2e-5f);
}

// ---- Lobes ------------------------------------------------------------------------------------------------------

// Integral over the hemisphere of directions, light or half vectors.
double over_hemisphere(const std::function<double(const Vector&)>& value, int steps = 400) {
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < 2 * steps; ++j) {
      const double cosine = (i + 0.5) / steps, turn = (j + 0.5) / steps * kPiDouble;
      sum += value(at_angle(static_cast<float>(cosine), static_cast<float>(turn)));
    }
  return sum * kPiDouble / (static_cast<double>(steps) * steps);
}

TEST(LayeredMaterial, AnisotropyWithoutStrengthIsRound) {
  Numbers random(3);
  for (int n = 0; n < 500; ++n) {
    LayeredPoint<float> m = white_point(0.2f + 0.8f * random.unit());
    m.anisotropy = 0;
    const float alpha = m.roughness * m.roughness;
    const Vector view = at_angle(0.1f + 0.9f * random.unit(), 6 * random.unit()),
                 light = at_angle(0.1f + 0.9f * random.unit(), 6 * random.unit());
    const Vector sum = view + light, half = sum * (1 / std::sqrt(dot(sum, sum)));
    const float a = anisotropic_ggx(m, alpha, view, light, half, half.z, view.z, light.z),
                b = ggx(alpha, half.z, view.z, light.z);
    EXPECT_NEAR(a, b, 1e-3f * b + 1e-6f);
  }
}

// A lobe returns no more than arrives, and nearly all of it where it is smooth enough to lose nothing.
TEST(LayeredMaterial, AnisotropicLobesKeepEnergy) {
  for (const float strength : {0.0f, 0.5f, 1.0f}) {
    LayeredPoint<float> m = white_point(0.5f);
    m.anisotropy = strength;
    for (const float turn : {0.0f, 0.8f, 1.57f}) {
      const Vector view = at_angle(0.7f, turn);
      const double sum = over_hemisphere([&](const Vector& light) {
        const Vector both_ways = view + light, half = both_ways * (1 / std::sqrt(dot(both_ways, both_ways)));
        return static_cast<double>(anisotropic_ggx(m, 0.25f, view, light, half, half.z, view.z, light.z) * light.z);
      });
      EXPECT_LT(sum, 1.001) << strength;
      EXPECT_GT(sum, 0.88 - 0.38 * static_cast<double>(strength)) << strength;
    }
  }
}

TEST(LayeredMaterial, TheSheensAlbedoIsItsIntegral) {
  double worst = 0;
  for (const float r : {0.1f, 0.2f, 0.35f, 0.5f, 0.75f, 1.0f})
    for (const float c : {0.1f, 0.2f, 0.4f, 0.7f, 1.0f}) {
      const Vector view = at_angle(c);
      const double sum = over_hemisphere([&](const Vector& light) {
        const Vector both_ways = view + light, half = both_ways * (1 / std::sqrt(dot(both_ways, both_ways)));
        return static_cast<double>(sheen_lobe(r, half.z, view.z, light.z) * light.z);
      });
      worst = std::max(worst, std::abs(std::min(sum, 1.0) - static_cast<double>(sheen_albedo(r, c))));
    }
  EXPECT_LT(worst, 0.02);
}

// A surface returns, over all views, no more light of one direction than arrives from it.
TEST(LayeredMaterial, LightsAreReturnedOnce) {
  LayeredPoint<float> m = white_point(0.6f);
  m.coat = 1, m.coat_roughness = 0.5f, m.sheen = grey(0.5f), m.sheen_roughness = 0.6f;
  m.transmission = 0.4f, m.spread = 0.5f, m.spread_color = grey(1);
  const Vector light = at_angle(0.8f, 1.0f);
  const auto returned = [&](const scene::EffectFlags& flags) {
    return over_hemisphere(
        [&](const Vector& view) {
          const LayerShares<float> shares = layer_shares(flags, m, view, view.z);
          return static_cast<double>(reflect_light(flags, m, shares, kUp, view, light).x * view.z / light.z);
        },
        200);
  };
  for (const scene::EffectFlags& flags :
       {scene::EffectFlags{}, scene::EffectFlags{.clearcoat = true}, scene::EffectFlags{.sheen = true},
        scene::EffectFlags{.diffuse_transmission = true},
        scene::EffectFlags{.clearcoat = true, .sheen = true, .transmission = true, .diffuse_transmission = true}}) {
    EXPECT_LT(returned(flags), 1.02);
    EXPECT_GT(returned(flags), 0.25);
  }
}

TEST(LayeredMaterial, LightFromBehindReachesDiffuseTransmission) {
  LayeredPoint<float> m = white_point(0.6f);
  m.spread = 1, m.spread_color = {0.5f, 0.25f, 0.125f};
  const Vector light{0, 0, -1};
  const scene::EffectFlags flags{.diffuse_transmission = true};
  const LayerShares<float> shares = layer_shares(flags, m, kUp, 1.0f);
  const Vector through = reflect_light(flags, m, shares, kUp, kUp, light);
  EXPECT_GT(through.x, 0.1f);
  EXPECT_NEAR(through.y, through.x / 2, 1e-6f);
  EXPECT_EQ(reflect_light(scene::EffectFlags{}, m, shares, kUp, kUp, light).x, 0.0f);
}

}  // namespace
}  // namespace tessera::shaders::layered_material_test
