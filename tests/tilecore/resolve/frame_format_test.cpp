// Pixels in the formats of a frame buffer.
#include "tilecore/resolve/frame_format.h"
#include "base/color.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::frame_format_test {
namespace {

constexpr FrameFormat kFixedPoint[] = {FrameFormat::kRgba8, FrameFormat::kRgb10a2};
constexpr float kExposures[] = {1.0f, 0.37f, 8.0f, 1000.0f};

unsigned max_code(FrameFormat format, std::size_t channel) { return (1u << channel_bits(format)[channel]) - 1; }

TEST(FrameFormat, BytesOfAPixelFollowFromItsChannels) {
  for (const FrameFormat format : {FrameFormat::kRgba8, FrameFormat::kRgb10a2, FrameFormat::kRgba16f}) {
    unsigned bits = 0;
    for (const std::uint8_t channel : channel_bits(format)) bits += channel;
    EXPECT_EQ(8 * frame_pixel_bytes(format), bits);
  }
  EXPECT_EQ(kFramePixelBytes, 4u);
}

TEST(FrameFormat, AStoredPixelReadsBackToTheSameCodes) {  // FF1
  for (const FrameFormat format : kFixedPoint)
    for (const float exposure : kExposures) {
      const PixelCoder coder(format, exposure);
      test::Random random(5);
      for (int trial = 0; trial < 20000; ++trial) {
        // Colours from black, over colours of which one channel is nothing, to twenty times white.
        const float most = trial % 2 == 0 ? 0.75f : 20.0f;
        Vec4 color(0.0f);
        for (int c = 0; c < 3; ++c) color[c] = std::max(0.0f, random.uniform(-0.2f, 1.0f)) * most / exposure;
        color.w = random.uniform(0.0f, 1.0f);
        const PixelCode stored = coder.code(color), again = coder.code(coder.stored(color));
        EXPECT_TRUE(again == stored || most > 1.0f) << exposure << " " << color.x << " " << color.y << " " << color.z;
        for (std::size_t c = 0; c < 4; ++c)
          EXPECT_NEAR(again[c], stored[c], 0.1 * max_code(format, c)) << color.x << " " << color.y << " " << color.z;
      }
    }
}

// A display shows the codes of rgba8 as they are: PNG files have them.
TEST(FrameFormat, Rgba8EqualsTheDisplayedImage) {
  const PixelCoder coder(FrameFormat::kRgba8, 1.7f);
  Image image(64, 64, 4);
  test::Random random(9);
  for (float& value : image.values) value = random.uniform(-0.5f, 4.0f);
  const Image8 shown = shaders::to_display(image, 1.7f);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto p = image.at(x, y);
      const PixelCode code = coder.code({p[0], p[1], p[2], p[3]});
      for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(code[c], shown.at(x, y)[c]);
    }
}

TEST(FrameFormat, ACodeIsTheNearestOnTheCurveOfADisplay) {  // FF2
  test::Random random(3);
  for (const FrameFormat format : kFixedPoint) {
    const PixelCoder coder(format, 2.0f);
    const double largest = max_code(format, 1);
    for (int trial = 0; trial < 2000; ++trial) {
      // Grey up to where the tone map bends, of which it leaves 0.04 out above twice that.
      const float light = random.uniform(0.0f, 0.39f);
      const double in = 2.0 * static_cast<double>(light), x = in < 0.08 ? 6.25 * in * in : in - 0.04,
                   exact = (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055) * largest;
      const PixelCode code = coder.code({light, light, light, 1.0f});
      EXPECT_LE(std::abs(static_cast<double>(code[1]) - exact), 0.5 + 1e-3);
      // The value read is off by half a step of the curve, which is a share of the light.
      const Vec3 read = shaders::tone_map(Vec3(coder.stored({light, light, light, 1.0f})) * 2.0f);
      EXPECT_NEAR(linear_to_srgb(read.y), exact / largest, 0.51 / largest);
    }
  }
}

TEST(FrameFormat, ColorsBeyondTheCodesAreClipped) {  // FF2
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  for (const FrameFormat format : kFixedPoint) {
    const PixelCoder coder(format, 0.5f);
    const auto bright = static_cast<std::uint16_t>(max_code(format, 0)),
               covered = static_cast<std::uint16_t>(max_code(format, 3));
    EXPECT_EQ(coder.code({1e6f, 1e7f, kInfinity, 1.5f}), (PixelCode{bright, bright, bright, covered}));
    EXPECT_EQ(coder.code({-1.0f, kNan, -kInfinity, kNan}), (PixelCode{0, 0, 0, 0}));
    EXPECT_TRUE(std::isfinite(coder.stored({1e6f, 0.0f, 0.0f, 1.0f}).x));
  }
}

TEST(FrameFormat, HalfFloatsKeepLinearLight) {
  const PixelCoder coder(FrameFormat::kRgba16f, 4.0f);
  const Vec4 color(0.1f, 1e9f, -3.0f, 0.3f), stored = coder.stored(color);
  EXPECT_FALSE(coder.tone_maps());
  EXPECT_NEAR(stored.x, 0.1f, 0.1f / 2048);
  EXPECT_EQ(stored.z, -3.0f);
  EXPECT_EQ(coder.code(color)[1], 0x7c00);
}

}  // namespace
}  // namespace tessera::tilecore::frame_format_test
