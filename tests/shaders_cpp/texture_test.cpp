#include "shaders_cpp/texture.h"
#include "base/color.h"
#include "tests/support/tests.h"

namespace tessera::shaders::texture_test {
namespace {

constexpr Wrap kWraps[] = {Wrap::kRepeat, Wrap::kMirroredRepeat, Wrap::kClampToEdge};

DecodedImage grey(int width, int height, std::vector<std::uint8_t> values) {
  Image8 image(width, height, 1);
  image.values = std::move(values);
  return {image};
}

// The definition: repeat and mirror by periods, clamp.
int wrapped(Wrap wrap, int i, int size) {
  if (wrap == Wrap::kClampToEdge) return i < 0 ? 0 : i >= size ? size - 1 : i;
  int period = i / size, rest = i % size;
  if (rest < 0) rest += size, --period;
  return wrap == Wrap::kMirroredRepeat && (period & 1) != 0 ? size - 1 - rest : rest;
}

TEST(Wrap, FollowsItsDefinitionFarOutAndNearBy) {
  for (const Wrap wrap : kWraps)
    for (const int size : {1, 2, 3, 7, 16}) {
      for (int i = -5 * size; i <= 5 * size; ++i) EXPECT_EQ(wrap_texel(wrap, i, size), wrapped(wrap, i, size));
      const int last = wrap == Wrap::kMirroredRepeat ? 2 * size : size;
      for (int i = -1; i <= last; ++i) EXPECT_EQ(wrap_near_texel(wrap, i, size), wrapped(wrap, i, size));
    }
}

TEST(LinearTexels, StayInsideForAnyCoordinate) {
  const float odd[] = {0.0f,
                       -0.0f,
                       1.0f,
                       0.5f,
                       -1e-20f,
                       1e30f,
                       -1e30f,
                       std::nextafter(1.0f, 0.0f),
                       std::nextafter(2.0f, 0.0f),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(),
                       std::nanf("")};
  for (const Wrap wrap : kWraps)
    for (const int size : {1, 2, 5})
      for (const float coordinate : odd) {
        const TexelPair pair = linear_texels(wrap, coordinate, size);
        EXPECT_TRUE(pair.first >= 0 && pair.first < size && pair.second >= 0 && pair.second < size) << coordinate;
        EXPECT_TRUE(pair.weight >= 0.0f && pair.weight <= 1.0f);
      }
}

TEST(Texture, TexelCentresAreExactAndMiddlesAreMeans) {
  const Texture texture(grey(2, 1, {0, 255}), ColorSpace::kLinear);
  Sampler clamp;
  clamp.wrap_s = clamp.wrap_t = Wrap::kClampToEdge;
  EXPECT_FLOAT_EQ(texture.sample(clamp, {0.25f, 0.5f}, 0).x, 0.0f);
  EXPECT_FLOAT_EQ(texture.sample(clamp, {0.75f, 0.5f}, 0).x, 1.0f);
  EXPECT_FLOAT_EQ(texture.sample(clamp, {0.5f, 0.5f}, 0).x, 0.5f);
  EXPECT_FLOAT_EQ(texture.sample(clamp, {-3.0f, 0.5f}, 0).x, 0.0f);
  Sampler repeat;
  EXPECT_FLOAT_EQ(texture.sample(repeat, {0.0f, 0.5f}, 0).x, 0.5f);  // between the last and the first texel
}

TEST(Texture, SrgbIsDecodedBeforeFiltering) {
  const Texture texture(grey(2, 1, {0, 255}), ColorSpace::kSrgb);
  Sampler clamp;
  clamp.wrap_s = clamp.wrap_t = Wrap::kClampToEdge;
  EXPECT_FLOAT_EQ(texture.sample(clamp, {0.5f, 0.5f}, 0).x, 0.5f);  // half of the light, not of the code
  EXPECT_NEAR(texture.texel(1, 0, 0).x, 0.5f, 0.005f);
}

TEST(Texture, MipLevelsKeepTheMeanForSizesThatAreNoPowersOfTwo) {
  for (const int width : {5, 6, 7, 12}) {
    std::vector<std::uint8_t> values;
    double mean = 0;
    for (int i = 0; i < width * 3; ++i) values.push_back(static_cast<std::uint8_t>((i * 97) % 256));
    for (const auto v : values) mean += v / 255.0 / static_cast<double>(values.size());
    const Texture texture(grey(width, 3, values), ColorSpace::kLinear);
    EXPECT_NEAR(static_cast<double>(texture.texel(texture.level_count() - 1, 0, 0).x), mean, 0.006) << width;
    EXPECT_EQ(texture.width(texture.level_count() - 1), 1);
  }
}

TEST(Texture, LevelsBlendContinuously) {
  const Texture texture(grey(8, 8, std::vector<std::uint8_t>(64, 200)), ColorSpace::kLinear);
  for (float lod = -1.0f; lod < 5.0f; lod += 0.13f)
    EXPECT_NEAR(texture.sample({}, {0.3f, 0.8f}, lod).x, 200.0f / 255.0f, 1e-5f);
}

TEST(Texture, GreyAndAlphaChannelsAreSpread) {
  Image8 grey_alpha(1, 1, 2);
  grey_alpha.values = {100, 50};
  const Texture texture({grey_alpha}, ColorSpace::kLinear);
  const Vec4 t = texture.texel(0, 0, 0);
  EXPECT_FLOAT_EQ(t.x, t.z);
  EXPECT_FLOAT_EQ(t.w, 50.0f / 255.0f);
  EXPECT_FALSE(texture.opaque());
}

TEST(ScalarTexture, SixteenBitsAreKept) {
  Image16 image(2, 1, 1);
  image.values = {1, 65535};
  const ScalarTexture texture(DecodedImage{image});
  EXPECT_FLOAT_EQ(texture.levels()[0].values[0], 1.0f / 65535.0f);
  EXPECT_FLOAT_EQ(texture.levels()[0].values[1], 1.0f);
}

TEST(ScalarTexture, TheGradientOfALinearRampIsExact) {
  std::vector<float> values;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) values.push_back(0.02f * static_cast<float>(x) + 0.01f * static_cast<float>(y));
  const ScalarTexture texture(16, 16, values);
  const auto g = texture.sample_gradient({}, {0.5f, 0.4f}, 0);
  EXPECT_NEAR(g.d_s, 0.02f * 16.0f, 1e-4f);
  EXPECT_NEAR(g.d_t, 0.01f * 16.0f, 1e-4f);
  EXPECT_NEAR(g.height, texture.sample({}, {0.5f, 0.4f}, 0), 1e-6f);
}

TEST(ScalarTexture, GradientHeightEqualsTheSampleAtEveryLevelOfDetail) {
  test::Random random(5);
  std::vector<float> values(64);
  for (float& v : values) v = random.uniform(0, 1);
  const ScalarTexture texture(8, 8, values);
  for (int i = 0; i < 500; ++i) {
    const Vec2 uv(random.uniform(-2, 3), random.uniform(-2, 3));
    const float lod = random.uniform(-1, 4);
    Sampler sampler;
    sampler.wrap_s = kWraps[i % 3];
    EXPECT_NEAR(texture.sample_gradient(sampler, uv, lod).height, texture.sample(sampler, uv, lod), 1e-6f);
  }
}

TEST(Color, TransferFunctionsInvertEachOther) {
  for (int i = 0; i <= 255; ++i) {
    const float code = static_cast<float>(i) / 255.0f;
    EXPECT_EQ(to_unorm8(linear_to_srgb(srgb_to_linear(code))), i);
  }
  EXPECT_EQ(to_unorm8(std::nanf("")), 0);
  EXPECT_EQ(to_unorm8(-4.0f), 0);
  EXPECT_EQ(to_unorm8(1e30f), 255);
}

}  // namespace
}  // namespace tessera::shaders::texture_test
