// Images of radiance: their texels, levels and lookups.
#include "shaders_cpp/radiance_image.h"
#include "base/half_float.h"
#include "tests/support/tests.h"

namespace tessera::shaders::radiance_image_test {
namespace {

RadianceImage random_chain(Random& random, RadianceImage::Size size) {
  RadianceImage image(RadianceImage::mip_chain(size));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      image.set(0, x, y, {random.uniform(0, 4), random.uniform(0, 1), random.coin() ? 100.0f : 0.0f});
  for (int level = 1; level < image.level_count(); ++level)
    image.reduce(level, {0, 0, image.width(level), image.height(level)});
  return image;
}

Vec3 seen(const RadianceImage& image, float u, float v, float lod) {
  LookupTexels<std::int32_t> read;
  const Vector3<float> a = sample_radiance<float, std::int32_t>(image.view(), u, v, lod, read);
  return {a.x, a.y, a.z};
}

TEST(RadianceImage, RoundsToHalfPrecision) {
  RadianceImage image(RadianceImage::mip_chain({2, 1}));
  const float infinite = std::numeric_limits<float>::infinity(), none = std::numeric_limits<float>::quiet_NaN();
  image.set(0, 0, 0, {-1.0f, infinite, none});
  image.set(0, 1, 0, {1.0f / 3.0f, 70000.0f, 1e-9f});
  EXPECT_EQ(image.texel(0, 0, 0), Vec3(0.0f, 65504.0f, 0.0f));
  EXPECT_EQ(image.texel(0, 1, 0), Vec3(round_to_half(1.0f / 3.0f), 65504.0f, 0.0f));
}

TEST(RadianceImage, ChainsEndWithOneTexel) {
  const auto chain = RadianceImage::mip_chain({7, 2});
  ASSERT_EQ(chain.size(), 3u);
  EXPECT_EQ(chain[1].width, 3);
  EXPECT_EQ(chain[1].height, 1);
  EXPECT_EQ(chain[2].width * chain[2].height, 1);
}

// Invariant RI1.
TEST(RadianceImage, RI1LevelsHaveTheMeanOfTheLevelAbove) {
  Random random(1);
  for (const RadianceImage::Size size : {RadianceImage::Size{64, 32}, {63, 31}, {5, 40}, {1, 9}, {1, 1}}) {
    const RadianceImage image = random_chain(random, size);
    for (int c = 0; c < 3; ++c) {
      const auto mean = [&](int level) {
        double sum = 0;
        for (int y = 0; y < image.height(level); ++y)
          for (int x = 0; x < image.width(level); ++x) sum += static_cast<double>(image.texel(level, x, y)[c]);
        return sum / (image.width(level) * image.height(level));
      };
      const double all = mean(0);
      for (int level = 1; level < image.level_count(); ++level)
        EXPECT_NEAR(mean(level), all, 0.002 * level * all) << size.width << "x" << size.height << " level " << level;
    }
    // No texel is beyond the range of the texels that it covers and their neighbours.
    for (int level = 1; level < image.level_count(); ++level)
      for (int y = 0; y < image.height(level); ++y)
        for (int x = 0; x < image.width(level); ++x) {
          float least = 1e9f, most = 0;
          for (int j = y * image.height(level - 1) / image.height(level);
               j < std::min((y + 1) * image.height(level - 1) / image.height(level) + 1, image.height(level - 1)); ++j)
            for (int i = x * image.width(level - 1) / image.width(level);
                 i < std::min((x + 1) * image.width(level - 1) / image.width(level) + 1, image.width(level - 1)); ++i)
              least = std::min(least, image.texel(level - 1, i, j).x),
              most = std::max(most, image.texel(level - 1, i, j).x);
          EXPECT_GE(image.texel(level, x, y).x, least * 0.999f);
          EXPECT_LE(image.texel(level, x, y).x, most * 1.001f);
        }
  }
}

// A level may be made part by part.
TEST(RadianceImage, PartsOfALevelAreItsOwn) {
  Random random(2);
  const RadianceImage whole = random_chain(random, {37, 21});
  RadianceImage parts(RadianceImage::mip_chain({37, 21}));
  for (int y = 0; y < 21; ++y)
    for (int x = 0; x < 37; ++x) parts.set(0, x, y, whole.texel(0, x, y));
  for (int level = 1; level < parts.level_count(); ++level) {
    const int middle = parts.width(level) / 2;
    parts.reduce(level, {middle, 0, parts.width(level), parts.height(level)});
    parts.reduce(level, {0, 0, middle, parts.height(level)});
    for (int y = 0; y < parts.height(level); ++y)
      for (int x = 0; x < parts.width(level); ++x)
        EXPECT_EQ(parts.texel(level, x, y), whole.texel(level, x, y)) << level << ": " << x << "," << y;
  }
}

TEST(RadianceImage, LookupsMeetTexelsAtTheirMiddlesAndTheMeanBetween) {
  Random random(3);
  const RadianceImage image = random_chain(random, {8, 4});
  for (int level = 0; level < image.level_count(); ++level)
    for (int y = 0; y < image.height(level); ++y)
      for (int x = 0; x < image.width(level); ++x) {
        const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(image.width(level)),
                    v = (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height(level));
        EXPECT_EQ(seen(image, u, v, static_cast<float>(level)), image.texel(level, x, y));
      }
  const Vec3 between = seen(image, 2.0f / 8, 0.5f / 4, 0), mean = (image.texel(0, 1, 0) + image.texel(0, 2, 0)) * 0.5f;
  EXPECT_NEAR(between.x, mean.x, 1e-5f);
  const Vec3 levels = seen(image, 0.3f, 0.6f, 0.25f), fine = seen(image, 0.3f, 0.6f, 0),
             coarse = seen(image, 0.3f, 0.6f, 1);
  EXPECT_NEAR(levels.x, fine.x * 0.75f + coarse.x * 0.25f, 1e-5f);
  // Outside: the edge; beyond the last level: that.
  EXPECT_EQ(seen(image, -3, 9, 0), image.texel(0, 0, 3));
  EXPECT_EQ(seen(image, 0.7f, 0.1f, 99), image.texel(image.level_count() - 1, 0, 0));
}

}  // namespace
}  // namespace tessera::shaders::radiance_image_test
