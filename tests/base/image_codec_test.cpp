#include "base/image_codec.h"
#include "base/error.h"
#include "base/random.h"
#include "tests/support/tests.h"

namespace tessera::image_codec_test {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

template <class T>
ImageOf<T> noise_image(int width, int height, int channels) {
  ImageOf<T> image(width, height, channels);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<T>(mix32(static_cast<std::uint32_t>(i)));
  return image;
}

DecodedImage decode(const std::string& bytes) {
  DecodedImage image;
  std::string fault;
  EXPECT_TRUE(decode_image(bytes_of(bytes), {}, image, fault)) << fault;
  return image;
}

std::string fault_of(const std::string& bytes) {
  DecodedImage image;
  std::string fault;
  EXPECT_FALSE(decode_image(bytes_of(bytes), {}, image, fault));
  return fault;
}

TEST(ImageCodec, PngKeepsEveryByteForEveryNumberOfChannels) {
  for (int channels = 1; channels <= 4; ++channels) {
    const Image8 image = noise_image<std::uint8_t>(13, 7, channels);
    const DecodedImage back = decode(encode_png(image));
    ASSERT_EQ(back.channels(), channels);
    EXPECT_EQ(std::get<Image8>(back.pixels).values, image.values);
    const Image16 deep = noise_image<std::uint16_t>(5, 9, channels);
    EXPECT_EQ(std::get<Image16>(decode(encode_png(deep)).pixels).values, deep.values);
  }
}

TEST(ImageCodec, JpegOfAFlatColourComesBackWithinQuantisation) {
  Image8 image(32, 16, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<std::uint8_t>(40 + 60 * (i % 3));
  const DecodedImage back = decode(encode_jpeg(image, 95));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(back.unorm(9, 9, c) * 255.0f, 40 + 60 * c, 3);
}

TEST(ImageCodec, EveryTruncatedPngIsRefused) {
  const std::string whole = encode_png(noise_image<std::uint8_t>(6, 5, 3));
  for (std::size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(fault_of(whole.substr(0, length)).empty());
}

TEST(ImageCodec, EveryTruncatedJpegIsRefused) {
  const std::string whole = encode_jpeg(noise_image<std::uint8_t>(16, 16, 3), 80);
  for (std::size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(fault_of(whole.substr(0, length)).empty());
}

TEST(ImageCodec, EveryFlippedBitOfAPngIsRefused) {
  const std::string whole = encode_png(noise_image<std::uint8_t>(4, 4, 1));
  for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
    std::string broken = whole;
    broken[bit / 8] = static_cast<char>(broken[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_FALSE(fault_of(broken).empty()) << "bit " << bit;
  }
}

TEST(ImageCodec, SizesBeyondTheLimitsAreRefusedBeforePixelsAreAllocated) {
  const std::string png = encode_png(Image8(40, 30, 1));
  DecodedImage image;
  std::string fault;
  EXPECT_THROW(decode_image(bytes_of(png), {.max_side = 39, .max_pixels = 1 << 20}, image, fault), LimitError);
  EXPECT_THROW(decode_image(bytes_of(png), {.max_side = 100, .max_pixels = 1199}, image, fault), LimitError);
  EXPECT_TRUE(decode_image(bytes_of(png), {.max_side = 40, .max_pixels = 1200}, image, fault));
}

TEST(ImageCodec, FormatsAreToldByTheirSignatures) {
  EXPECT_EQ(image_format(bytes_of(encode_png(Image8(1, 1, 1)))), ImageFormat::kPng);
  EXPECT_EQ(image_format(bytes_of(encode_jpeg(Image8(8, 8, 1), 50))), ImageFormat::kJpeg);
  EXPECT_EQ(image_format(bytes_of("GIF89a")), ImageFormat::kUnknown);
}

}  // namespace
}  // namespace tessera::image_codec_test
