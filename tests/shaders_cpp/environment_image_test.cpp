// Environment images against closed forms and integrals in double precision.
#include "shaders_cpp/environment_image.h"
#include "base/half_float.h"
#include "base/parallel.h"
#include "shaders_cpp/environment.h"
#include "shaders_cpp/metallic_roughness.h"
#include "tests/support/environments.h"
#include "tests/support/tests.h"

namespace tessera::shaders::environment_image_test {
namespace {

using Light = std::function<DVec3(const DVec3&)>;

constexpr double kPiDouble = std::numbers::pi;

DVec3 random_direction(test::Random& random) {
  while (true) {
    const DVec3 d(random.in_box(1.0f));
    if (const double length = glm::length(d); length > 0.1 && length <= 1.0) return d / length;
  }
}

std::shared_ptr<const EnvironmentImage> image_of(int height, const Light& light, double rotation = 0) {
  return std::make_shared<const EnvironmentImage>(test::sky_image(height, light), rotation);
}

Environment seen_in(const EnvironmentImage& image) { return Environment(test::surroundings_of(image)); }

// Pixels as a camera has them: means over their area.
Image averaged_sky(int height, const std::function<double(const DVec3&)>& light) {
  constexpr int kSide = 4;
  const Image fine = test::sky_image(kSide * height, [&](const DVec3& d) { return DVec3(light(d)); });
  Image image(2 * height, height, 3);
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        image.at(x / kSide, y / kSide)[c] += fine.at(x, y)[c] / static_cast<float>(kSide * kSide);
  return image;
}

double level_roughness(double level) { return std::exp2(0.5 * (level - (kMapLevels - 1))); }

// Invariant ENV1.
TEST(EnvironmentImage, ENV1AConstantImageIsThatConstantEverywhere) {
  test::Random random(1);
  for (const int height : {1, 2, 37, 130}) {
    const DVec3 constant(0.5, 3.25, 1000.0);
    const auto image = image_of(height, [&](const DVec3&) { return constant; });
    const Environment environment = seen_in(*image);
    for (int i = 0; i < 300; ++i) {
      const Vec3 direction(random_direction(random));
      EXPECT_EQ(environment.specular(direction, random.uniform(0, 1)), Vec3(constant)) << height;
      EXPECT_EQ(environment.background(direction), Vec3(constant));
      const Vec3 diffuse = environment.diffuse(direction);
      for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(diffuse[c], static_cast<float>(constant[c]));
    }
  }
}

// Where three.js' equirectUv() puts a direction, in an image whose first row is the top one.
TEST(EnvironmentImage, DirectionsFollowThreeJs) {
  constexpr int kHeight = 64;
  for (const DVec3& direction : {DVec3(1, 0, 0), DVec3(0, 0, 1), DVec3(-1, 0, 0.001), DVec3(0, 0, -1), DVec3(0, 1, 0),
                                 DVec3(0, -1, 0), DVec3(0.48, 0.6, 0.64), DVec3(-0.48, -0.6, -0.64)}) {
    const double u = std::atan2(direction.z, direction.x) / (2 * kPiDouble) + 0.5,
                 v = std::asin(std::clamp(direction.y, -1.0, 1.0)) / kPiDouble + 0.5;
    Image image(2 * kHeight, kHeight, 3);
    const int column = static_cast<int>(u * 2 * kHeight) % (2 * kHeight),
              row = std::min(static_cast<int>((1 - v) * kHeight), kHeight - 1);
    // A spot of light there.
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < 2 * kHeight; ++x) {
        const bool pole = std::abs(direction.y) == 1;
        const int across = std::abs(x - column), away = std::min(across, 2 * kHeight - across);
        if (std::abs(y - row) < 3 && (pole || away < 3)) image.at(x, y)[0] = 1.0f;
      }
    const EnvironmentImage map(std::move(image), 0.0);
    EXPECT_GT(seen_in(map).background(Vec3(direction)).x, 0.9f)
        << direction.x << ' ' << direction.y << ' ' << direction.z;
    EXPECT_EQ(seen_in(map).background(Vec3(-direction)).x, 0.0f);
    const Vec3 towards = seen_in(map).diffuse(Vec3(direction)), against = seen_in(map).diffuse(Vec3(-direction));
    EXPECT_GT(towards.x, 5 * against.x);
  }
}

// The rotation is counterclockwise seen from above: after a quarter of the circle, light from
// +z comes from +x.
TEST(EnvironmentImage, RotationTurnsItAboutTheVerticalAxis) {
  const Light light = [](const DVec3& d) { return DVec3(0.5 + 0.5 * d.x, 0.5 + 0.5 * d.y, 0.5 + 0.5 * d.z); };
  for (const double angle : {0.5 * kPiDouble, 0.3, -2.0, 40.0}) {
    const auto image = image_of(128, light, angle);
    test::Random random(2);
    for (int i = 0; i < 100; ++i) {
      const DVec3 d = random_direction(random);
      const DVec3 before(d.x * std::cos(angle) - d.z * std::sin(angle), d.y,
                         d.x * std::sin(angle) + d.z * std::cos(angle));
      const DVec3 expected = light(before), found(seen_in(*image).background(Vec3(d)));
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.01) << angle;
    }
  }
}

// The cosine's lobe leaves two thirds of a gradient.
TEST(EnvironmentImage, DiffuseLightOfAGradientIsExact) {
  const DVec3 a(1, 2, 3), b(0.9, -1.5, 2.0);
  const auto image = image_of(256, [&](const DVec3& d) { return a + b * d.y; });
  test::Random random(3);
  for (int i = 0; i < 200; ++i) {
    const DVec3 n = random_direction(random), found(seen_in(*image).diffuse(Vec3(n)));
    const DVec3 expected = a + b * (2.0 / 3.0 * n.y);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-4);
  }
}

// Nine harmonics of a single distant light are farthest off where it is below or just above the horizon.
TEST(EnvironmentImage, DiffuseLightOfADistantLightIsWithinATenthOfTheLargest) {
  const DVec3 sun = glm::normalize(DVec3(0.3, 0.8, -0.5));
  const auto image = image_of(256, [&](const DVec3& d) { return DVec3(glm::dot(d, sun) > 0.999 ? 1000.0 : 0.0); });
  const double largest = 1000.0 * 2.0 * kPiDouble * 0.001 / kPiDouble;
  double worst = 0;
  test::Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const DVec3 n = random_direction(random);
    const double expected = largest * std::max(0.0, glm::dot(n, sun)),
                 found = DVec3(seen_in(*image).diffuse(Vec3(n))).x;
    worst = std::max(worst, std::abs(found - expected) / largest);
  }
  EXPECT_LT(worst, 0.1);
  EXPECT_GT(worst, 0.08) << "the header states the bound";
}

TEST(EnvironmentImage, TheStudiosOwnImageEqualsTheStudio) {
  const Environment studio;
  const auto image = image_of(512, [&](const DVec3& d) { return DVec3(studio.specular(Vec3(d), 0.0f)); });
  const Environment found = seen_in(*image);
  test::Random random(5);
  for (int i = 0; i < 400; ++i) {
    const Vec3 d(random_direction(random));
    const Vec3 mirror = studio.specular(d, 0), diffuse = studio.diffuse(d);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(found.specular(d, 0)[c], mirror[c], 0.002f + 0.002f * mirror[c]);
      EXPECT_NEAR(found.diffuse(d)[c], diffuse[c], 0.04 * 1.44);  // of the largest
    }
    for (const float roughness : {0.1f, 0.25f, 0.4f, 0.6f, 0.8f, 1.0f}) {
      const Vec3 a = studio.specular(d, roughness), b = found.specular(d, roughness);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.06f + 0.04f * a[c]) << roughness;
    }
  }
}

// ---- Lobes ------------------------------------------------------------------------------------------------------

// Through the lobe around a direction seen head-on, ring by ring of the half vectors' distribution.
double integral(const std::function<double(const DVec3&)>& light, const DVec3& axis, double roughness) {
  const double alpha2 = std::pow(roughness, 4);
  const DVec3 first = glm::normalize(glm::cross(std::abs(axis.y) < 0.9 ? DVec3(0, 1, 0) : DVec3(1, 0, 0), axis)),
              second = glm::cross(axis, first);
  constexpr int kRings = 400, kSlices = 240;
  double sum = 0, weights = 0;
  for (int i = 0; i < kRings; ++i) {
    // More rings outside than there is light.
    const double v = 1 - (i + 0.5) / kRings, u = 1 - v * v, half2 = (1 - u) / (1 + (alpha2 - 1) * u), y = 2 * half2 - 1;
    if (y <= 0) continue;
    const double weight = 2 * v * 2 * y / (y + std::sqrt(y * y * (1 - alpha2) + alpha2)), out = std::sqrt(1 - y * y);
    double ring = 0;
    for (int k = 0; k < kSlices; ++k) {
      const double angle = 2 * kPiDouble * (k + 0.5 * (i % 2)) / kSlices;
      ring += light(first * (out * std::cos(angle)) + second * (out * std::sin(angle)) + axis * y);
    }
    sum += weight * ring / kSlices;
    weights += weight;
  }
  return sum / weights;
}

struct Scene {
  const char* name;
  std::function<double(const DVec3&)> light;
  double of_first, of_levels, between;  // errors that are allowed: of the two first lobes, of the others, between two
};

TEST(EnvironmentImage, LevelsAreTheIntegralsOfTheirLobes) {
  const DVec3 edge = glm::normalize(DVec3(0.3, 0.8, -0.5));
  const std::vector<Scene> scenes = {
      {"step", [&](const DVec3& d) { return glm::dot(d, edge) > 0.2 ? 1.0 : 0.0; }, 0.05, 0.03, 0.05},
      {"waves",
       [](const DVec3& d) { return 0.5 + 0.5 * std::sin(20 * d.x) * std::sin(17 * d.y + 2) * std::cos(11 * d.z); },
       0.02, 0.02, 0.02}};
  for (const Scene& scene : scenes) {
    const EnvironmentImage image(averaged_sky(512, scene.light), 0.0);
    const Environment found = seen_in(image);
    test::Random random(6);
    for (int level = 1; level < kMapLevels; ++level)
      for (int i = 0; i < 40; ++i) {
        DVec3 d = random_direction(random);
        // Half of them across the step.
        if (i % 2 == 0) {
          const DVec3 along = glm::normalize(d - edge * glm::dot(d, edge));
          const double roughness = level_roughness(level);
          d = glm::normalize(along * std::sqrt(0.96) + edge * 0.2 + DVec3(random.in_box(1)) * roughness * roughness);
        }
        const auto error = [&](double at) {
          const double roughness = level_roughness(at),
                       seen = DVec3(found.specular(Vec3(d), static_cast<float>(roughness))).x;
          return std::abs(seen - integral(scene.light, d, roughness));
        };
        EXPECT_LT(error(level), level <= 2 ? scene.of_first : scene.of_levels) << scene.name << ", level " << level;
        if (level + 1 < kMapLevels) {
          EXPECT_LT(error(level + 0.5), scene.between) << scene.name << ", above level " << level;
        }
      }
  }
}

// Half the difference between the mixture of two neighbouring lobes and the true lobe between them.
TEST(EnvironmentImage, LobesBetweenLevelsDifferFromTheirMixtureAsStated) {
  constexpr int kAngles = 4000;
  std::vector<double> angles, solid_angles;
  for (int i = 0; i < kAngles; ++i) {
    const auto at = [](double k) { return 1e-4 * std::pow(kPiDouble / 1e-4, k / kAngles); };
    angles.push_back(at(i + 0.5));
    solid_angles.push_back(2 * kPiDouble * (std::cos(at(i)) - std::cos(at(i + 1.0))));
  }
  const auto lobe = [&](double roughness) {
    const double alpha2 = std::pow(roughness, 4);
    std::vector<double> density;
    double sum = 0;
    for (int i = 0; i < kAngles; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double half2 = std::pow(std::cos(angles[k] / 2), 2), y = std::max(std::cos(angles[k]), 0.0),
                   spread = half2 * (alpha2 - 1) + 1;
      density.push_back(y > 0 ? alpha2 / (spread * spread) * y / (y + std::sqrt(y * y * (1 - alpha2) + alpha2)) : 0.0);
      sum += density.back() * solid_angles[k];
    }
    for (double& d : density) d /= sum;
    return density;
  };
  for (int level = 1; level + 1 < kMapLevels; ++level) {
    const std::vector<double> low = lobe(level_roughness(level)), high = lobe(level_roughness(level + 1));
    double worst = 0;
    for (double share = 0.1; share < 1; share += 0.1) {
      const std::vector<double> exact = lobe(level_roughness(level + share));
      double difference = 0;
      for (std::size_t i = 0; i < angles.size(); ++i)
        difference += std::abs(low[i] + (high[i] - low[i]) * share - exact[i]) * solid_angles[i] / 2;
      worst = std::max(worst, difference);
    }
    EXPECT_LT(worst, level < 6 ? 0.045 : 0.028) << level;
    EXPECT_GT(worst, 0.015) << level;
  }
}

// ---- The map ----------------------------------------------------------------------------------------------------

// Invariant ENV2: over folds and edges of the octahedron nothing jumps.
TEST(EnvironmentImage, ENV2NeighbouringDirectionsSeeNeighbouringLight) {
  const auto image = test::noisy_environment(64, 9);
  const Environment environment = seen_in(*image);
  test::Random random(7);
  const double range = 4.0, texel = std::sqrt(4 * kPiDouble) / 64 / 2.3;  // of the smallest one
  for (int i = 0; i < 3000; ++i) {
    // In the planes where octants meet, most of all below, where the map's edges and corners are.
    DVec3 d = random_direction(random);
    if (i % 4 == 0) d.x = 0;
    if (i % 4 == 1) d.z = 0;
    if (i % 4 == 2) d.y = 0;
    if (i % 16 == 3) d.x = d.z = 0;
    if (i % 2 == 0) d.y = -std::abs(d.y);
    if (glm::length(d) < 1e-6) continue;
    d = glm::normalize(d);
    constexpr double kStep = 1e-4;
    const DVec3 other = glm::normalize(d + DVec3(random.in_box(1)) * kStep);
    for (const float roughness : {0.0f, 0.05f, 0.3f, 1.0f}) {
      const Vec3 a = environment.specular(Vec3(d), roughness), b = environment.specular(Vec3(other), roughness);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 2 * range * kStep * 1.8 / texel) << roughness;
    }
  }
}

TEST(EnvironmentImage, ENV2BordersHoldTheTexelsBeyondTheEdges) {
  const auto image = test::noisy_environment(130, 4);
  const RadianceImage& levels = image->levels();
  ASSERT_EQ(levels.level_count(), kMapLevels);
  for (int level = 0; level < kMapLevels; ++level) {
    const int whole = levels.width(level), border = whole / 34, side = whole - 2 * border;
    EXPECT_EQ(levels.height(level), whole);
    EXPECT_EQ(static_cast<float>(side) / static_cast<float>(whole), kMapInside);
    const auto texel = [&](int x, int y) { return levels.texel(level, border + x, border + y); };
    for (int i = 0; i < side; ++i)
      for (int k = 0; k < border; ++k) {
        EXPECT_EQ(texel(-1 - k, i), texel(k, side - 1 - i));
        EXPECT_EQ(texel(side + k, i), texel(side - 1 - k, side - 1 - i));
        EXPECT_EQ(texel(i, -1 - k), texel(side - 1 - i, k));
        EXPECT_EQ(texel(i, side + k), texel(side - 1 - i, side - 1 - k));
      }
    EXPECT_EQ(texel(-1, -1), texel(side - 1, side - 1));
    EXPECT_EQ(texel(side, -1), texel(0, side - 1));
  }
}

// Invariant ENV3.
TEST(EnvironmentImage, ENV3IsTheSameForAnyNumberOfThreads) {
  const auto whole = test::noisy_environment(40, 2);
  std::shared_ptr<const EnvironmentImage> alone;
  with_threads(1, [&] { alone = test::noisy_environment(40, 2); });
  EXPECT_EQ(whole->diffuse, alone->diffuse);
  for (int level = 0; level < kMapLevels; ++level)
    for (int y = 0; y < whole->levels().height(level); ++y)
      for (int x = 0; x < whole->levels().width(level); ++x)
        ASSERT_EQ(whole->levels().texel(level, x, y), alone->levels().texel(level, x, y)) << level;
}

TEST(EnvironmentImage, ValuesOutOfRangeAreClamped) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const auto& [value, counted] : {std::pair{nan, 0.0f},
                                       {-infinity, 0.0f},
                                       {-3.0f, 0.0f},
                                       {infinity, RadianceImage::kLargest},
                                       {1e30f, RadianceImage::kLargest}}) {
    Image image(64, 32, 4);
    for (float& v : image.values) v = value;
    const EnvironmentImage map(std::move(image), 0.0);
    for (const float roughness : {0.0f, 0.4f, 1.0f})
      EXPECT_EQ(seen_in(map).specular({0.6f, 0.64f, -0.48f}, roughness), Vec3(counted));
    EXPECT_NEAR(seen_in(map).diffuse(Vec3(0, 1, 0)).x, counted, counted * 1e-6f);
  }
}

// Sides follow the image; one that is much finer is reduced first.
TEST(EnvironmentImage, HasAboutAsManyTexelsAsItsSource) {
  for (const auto& [height, side] : {std::pair{1, 64}, {64, 64}, {65, 128}, {512, 512}}) {
    const auto image = image_of(height, [](const DVec3&) { return DVec3(1.0); });
    EXPECT_EQ(image->levels().width(0), side + side / 16) << height;
    EXPECT_EQ(image->source_width(), 2 * height);
  }
  const auto fine = image_of(2500, [](const DVec3& d) { return DVec3(1.0 + d.y, 1.0, 1.0 + d.x); });
  EXPECT_EQ(fine->levels().width(0), 1088);
  test::Random random(8);
  for (int i = 0; i < 200; ++i) {
    const DVec3 d = random_direction(random), found(seen_in(*fine).background(Vec3(d)));
    EXPECT_NEAR(found.x, 1 + d.y, 0.004);
    EXPECT_NEAR(found.z, 1 + d.x, 0.004);
  }
}

// A mirror reads one level; a lobe of a level that one alone; others two.
TEST(EnvironmentImage, LookupsReadTheLevelsOfTheirRoughness) {
  const auto image = test::noisy_environment(64, 1);
  const auto levels_of = [&](float roughness) {
    LookupTexels<std::int32_t> read;
    environment_specular(*image, Vector3<float>{0.6f, 0.64f, -0.48f}, roughness, read);
    return std::pair{read.fine.level, read.coarse.level};
  };
  EXPECT_EQ(levels_of(0.0f), std::pair(0, -1));
  EXPECT_EQ(levels_of(0.05f), std::pair(0, 1));
  EXPECT_EQ(levels_of(0.6f), std::pair(6, 7));
  EXPECT_EQ(levels_of(0.5f), std::pair(6, -1));
  EXPECT_EQ(levels_of(1.0f), std::pair(8, -1));
  EXPECT_EQ(levels_of(7.0f), std::pair(8, -1));
}

// ---- The white furnace ------------------------------------------------------------------------------------------

TEST(EnvironmentImage, WhiteSurfacesInAWhiteImageStayWhite) {
  const auto image = image_of(16, [](const DVec3&) { return DVec3(1.0); });
  const std::array<Environment, 2> furnaces = {seen_in(*image),
                                               Environment({Surroundings::Kind::kUniform, 1, nullptr})};
  for (const Environment& furnace : furnaces)
    for (float roughness = 0; roughness <= 1.0f; roughness += 1 / 16.0f)
      for (const float cosine : {0.05f, 0.3f, 0.7f, 1.0f})
        for (const float metallic : {0.0f, 1.0f}) {
          const MaterialPoint<float> white{{1, 1, 1}, metallic, roughness, 1, {}};
          const Vector3<float> view{std::sqrt(1 - cosine * cosine), 0, cosine};
          const Vector3<float> light = shade_material(white, {}, {0, 0, 1}, view, {}, 0.0f, furnace);
          for (const float v : {light.x, light.y, light.z})
            EXPECT_NEAR(v, 1.0f, 0.02f) << roughness << ' ' << cosine << ' ' << metallic;
        }
}

}  // namespace
}  // namespace tessera::shaders::environment_image_test
