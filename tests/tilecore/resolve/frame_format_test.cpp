// Pixels in the formats of a frame buffer.
#include "tilecore/resolve/frame_format.h"
#include "base/color.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::frame_format_test {
namespace {

constexpr FrameFormat kFixedPoint[] = {FrameFormat::kRgba8, FrameFormat::kRgb10a2};
constexpr float kExposures[] = {1.0f, 0.37f, 8.0f, 1000.0f};

unsigned max_code(FrameFormat format, std::size_t channel) { return (1u << channel_bits(format)[channel]) - 1; }

TEST(FrameFormat, BytesOfAPixelAreThoseOfItsChannels) {
  for (const FrameFormat format : {FrameFormat::kRgba8, FrameFormat::kRgb10a2, FrameFormat::kRgba16f}) {
    unsigned bits = 0;
    for (const std::uint8_t channel : channel_bits(format)) bits += channel;
    EXPECT_EQ(8 * frame_pixel_bytes(format), bits);
  }
  EXPECT_EQ(kFramePixelBytes, 8u);
}

TEST(FrameFormat, WhatAnImageHoldsOfAStoredPixelIsThatPixelAgain) {  // FF1
  for (const FrameFormat format : kFixedPoint)
    for (const float exposure : kExposures) {
      const PixelCoder coder(format, exposure);
      // Grey of every code of light; coverage with it.
      for (unsigned code = 0; code <= max_code(format, 0); ++code) {
        const float light =
            srgb_to_linear(static_cast<float>(code) / static_cast<float>(max_code(format, 0))) / exposure;
        const Vec4 color(light, light, light, static_cast<float>(code % 4) / 3.0f);
        const PixelCode stored = coder.code(color);
        EXPECT_EQ(stored[0], code) << exposure;
        const Vec4 held = coder.stored(color), again = coder.stored(held);
        EXPECT_EQ(coder.code(held), stored) << exposure << " " << code;
        for (int c = 0; c < 4; ++c) EXPECT_EQ(again[c], held[c]) << exposure << " " << code;
      }
    }
}

TEST(FrameFormat, ACodeIsTheNearestOnTheCurveOfADisplay) {  // FF2
  test::Random random(3);
  for (const FrameFormat format : kFixedPoint) {
    const PixelCoder coder(format, 2.0f);
    const double largest = max_code(format, 1);
    for (int trial = 0; trial < 2000; ++trial) {
      const float light = random.uniform(0.0f, 0.5f);
      const double x = 2.0 * static_cast<double>(light),
                   exact = (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055) * largest;
      const PixelCode code = coder.code({light, light, light, 1.0f});
      EXPECT_LE(std::abs(static_cast<double>(code[1]) - exact), 0.5 + 1e-3);
      // The image is off by half a step of the curve, which is a share of the light.
      EXPECT_NEAR(linear_to_srgb(2.0f * coder.stored({light, light, light, 1.0f}).y), exact / largest, 0.51 / largest);
    }
  }
}

TEST(FrameFormat, WhatNoCodeStandsForIsClipped) {  // FF2
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  for (const FrameFormat format : kFixedPoint) {
    const PixelCoder coder(format, 0.5f);
    const auto bright = static_cast<std::uint16_t>(max_code(format, 0)),
               covered = static_cast<std::uint16_t>(max_code(format, 3));
    EXPECT_EQ(coder.code({2.0f, 2.1f, kInfinity, 1.5f}), (PixelCode{bright, bright, bright, covered}));
    EXPECT_EQ(coder.code({-1.0f, kNan, -kInfinity, kNan}), (PixelCode{0, 0, 0, 0}));
    EXPECT_FLOAT_EQ(coder.stored({100.0f, 0.0f, 0.0f, 1.0f}).x, 2.0f);
  }
}

TEST(FrameFormat, HalfFloatsLeaveTheImageAlone) {
  const PixelCoder coder(FrameFormat::kRgba16f, 4.0f);
  const Vec4 color(0.1f, 1e9f, -3.0f, 0.3f), stored = coder.stored(color);
  EXPECT_FALSE(coder.quantises());
  for (int c = 0; c < 4; ++c) EXPECT_EQ(stored[c], color[c]);
  EXPECT_EQ(coder.code(color)[1], 0x7c00);
}

}  // namespace
}  // namespace tessera::tilecore::frame_format_test
