#include "base/webp_codec.h"
#include "base/error.h"
#include "base/image_codec.h"
#include "base/random.h"
#include "tests/support/heap_meter.h"
#include "tests/support/tests.h"

namespace tessera::webp_codec_test {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Image8 noise(int width, int height, int channels) {
  Image8 image(width, height, channels);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<std::uint8_t>(mix32(static_cast<std::uint32_t>(i)));
  return image;
}

// Slow waves, which lossy compression keeps.
Image8 waves(int width, int height, int channels) {
  Image8 image(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c)
        image.at(x, y)[static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(128 + 100 * std::sin(0.1 * x + c) * std::cos(0.07 * y));
  return image;
}

DecodedImage decode(const std::string& bytes) {
  DecodedImage image;
  std::string fault;
  EXPECT_TRUE(decode_image(bytes_of(bytes), {}, image, fault)) << fault;
  return image;
}

TEST(WebpCodec, LosslessKeepsEveryByteColoursBehindTransparencyIncluded) {
  for (const int channels : {3, 4})
    for (const auto& [width, height] : {std::pair{1, 1}, {17, 5}, {64, 64}}) {
      const Image8 image = noise(width, height, channels);
      const DecodedImage back = decode(encode_webp(image, 0, true));
      ASSERT_EQ(back.channels(), channels);
      EXPECT_EQ(std::get<Image8>(back.pixels).values, image.values);
    }
}

TEST(WebpCodec, LossyImagesComeBackCloserTheHigherTheQuality) {
  for (const int channels : {3, 4}) {
    const Image8 image = waves(100, 60, channels);
    double error_of[2] = {};
    for (const int high : {0, 1}) {
      const DecodedImage back = decode(encode_webp(image, high == 1 ? 95 : 5, false));
      ASSERT_EQ(back.channels(), channels);
      const std::vector<std::uint8_t>& values = std::get<Image8>(back.pixels).values;
      for (std::size_t i = 0; i < values.size(); ++i) error_of[high] += std::abs(values[i] - image.values[i]);
      error_of[high] /= static_cast<double>(values.size());
    }
    EXPECT_LT(error_of[1], 3);
    EXPECT_LT(error_of[1], error_of[0]);
  }
}

TEST(WebpCodec, EncodingIsDeterministic) {
  const Image8 image = waves(70, 33, 4);
  EXPECT_EQ(encode_webp(image, 80, false), encode_webp(image, 80, false));
  EXPECT_EQ(encode_webp(image, 80, true), encode_webp(image, 80, true));
}

TEST(WebpCodec, EveryTruncatedFileIsRefused) {
  for (const bool lossless : {true, false})
    for (const int channels : {3, 4}) {
      const std::string whole = encode_webp(noise(12, 9, channels), 60, lossless);
      for (std::size_t length = 0; length < whole.size(); ++length) {
        DecodedImage image;
        std::string fault;
        EXPECT_FALSE(decode_image(bytes_of(whole.substr(0, length)), {}, image, fault)) << length;
        EXPECT_FALSE(fault.empty());
      }
    }
}

TEST(WebpCodec, AnyFlippedBitIsDecodedOrRefusedInWords) {
  for (const bool lossless : {true, false}) {
    const std::string whole = encode_webp(noise(6, 5, 4), 60, lossless);
    for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
      std::string broken = whole;
      broken[bit / 8] = static_cast<char>(broken[bit / 8] ^ (1 << (bit % 8)));
      DecodedImage image;
      std::string fault;
      try {
        const bool sound = decode_image(bytes_of(broken), {.max_side = 64, .max_pixels = 4096}, image, fault);
        EXPECT_NE(sound, !fault.empty()) << bit;
      } catch (const LimitError&) {
      }
    }
  }
}

TEST(WebpCodec, SizesBeyondTheLimitsAreRefusedBeforePixelsAreAllocated) {
  const std::string webp = encode_webp(Image8(40, 30, 3), 50, false);
  DecodedImage image;
  std::string fault;
  EXPECT_THROW(decode_image(bytes_of(webp), {.max_side = 39, .max_pixels = 1 << 20}, image, fault), LimitError);
  EXPECT_THROW(decode_image(bytes_of(webp), {.max_side = 100, .max_pixels = 1199}, image, fault), LimitError);
  EXPECT_TRUE(decode_image(bytes_of(webp), {.max_side = 40, .max_pixels = 1200}, image, fault));
}

TEST(WebpCodec, ChargesAtLeastThePeakHeapOfDecoding) {
  for (const bool lossless : {true, false})
    for (const int channels : {3, 4})
      for (const auto& [width, height] : {std::pair{16, 16}, {500, 40}, {40, 500}, {300, 300}})
        for (const bool smooth : {true, false}) {
          const std::string webp =
              encode_webp(smooth ? waves(width, height, channels) : noise(width, height, channels), 80, lossless);
          std::uint64_t charged = 0;
          DecodedImage image;
          std::string fault;
          const test::HeapMeter meter;
          EXPECT_TRUE(decode_image(bytes_of(webp), {}, image, fault, [&](std::uint64_t bytes) { charged = bytes; }));
          EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(charged))
              << width << "x" << height << "x" << channels << (lossless ? " lossless" : " lossy");
        }
}

TEST(WebpCodec, SidesBeyondTheFormatsLimitCannotBeWritten) {
  EXPECT_THROW(encode_webp(Image8(16384, 1, 3), 80, false), SystemError);
}

TEST(WebpCodec, IsToldByItsSignature) {
  EXPECT_EQ(image_format(bytes_of(encode_webp(Image8(1, 1, 3), 80, false))), ImageFormat::kWebp);
  EXPECT_STREQ(mime_type(ImageFormat::kWebp), "image/webp");
  EXPECT_EQ(image_format(bytes_of("RIFF....WAVE")), ImageFormat::kUnknown);
}

}  // namespace
}  // namespace tessera::webp_codec_test
