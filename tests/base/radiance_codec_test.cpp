// Images of radiance in memory: the meaning of their bytes, and refusals of other bytes.
#include "base/radiance_codec.h"
#include "base/error.h"
#include "base/exr_file.h"
#include "tests/support/radiance_files.h"
#include "tests/support/tests.h"

namespace tessera::radiance_codec_test {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Image decoded(const std::string& bytes) {
  Image image;
  std::string fault;
  EXPECT_TRUE(decode_radiance(bytes_of(bytes), {}, image, fault)) << fault;
  return image;
}

std::string fault_of(const std::string& bytes) {
  Image image;
  std::string fault;
  EXPECT_FALSE(decode_radiance(bytes_of(bytes), {}, image, fault));
  return fault;
}

std::string head(int width, int height, const char* sign = "-") {
  return fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{}Y {} +X {}\n", sign, height, width);
}

// The encoding by channels, with runs where bytes repeat.
std::string by_channels(const Image& image) {
  std::string bytes = head(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    bytes += {2, 2, static_cast<char>(image.width >> 8), static_cast<char>(image.width & 0xFF)};
    for (std::size_t channel = 0; channel < 4; ++channel) {
      std::vector<std::uint8_t> row;
      for (int x = 0; x < image.width; ++x) {
        const auto pixel = image.at(x, y);
        row.push_back(test::rgbe(pixel[0], pixel[1], pixel[2])[channel]);
      }
      for (std::size_t x = 0; x < row.size();) {
        std::size_t run = 1;
        while (x + run < row.size() && row[x + run] == row[x] && run < 127) ++run;
        if (run > 2) {
          bytes += {static_cast<char>(128 + run), static_cast<char>(row[x])};
        } else {
          run = 1;
          bytes += {1, static_cast<char>(row[x])};
        }
        x += run;
      }
    }
  }
  return bytes;
}

Image steps(int width, int height) {
  Image image(width, height, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = std::ldexp(static_cast<float>(128 + i / 9 * 7 % 128), static_cast<int>(i / 30 % 12) - 10);
  return image;
}

TEST(RadianceCodec, AChannelIsItsByteTimesAPowerOfTwo) {
  const Image image = decoded(head(2, 1) + std::string("\x80\x40\xFF\x80\x80\x80\x80\x00", 8));
  ASSERT_EQ(image.width, 2);
  ASSERT_EQ(image.channels, 3);
  const std::vector<float> expected = {0.5f, 0.25f, 255.0f / 256.0f, 0, 0, 0};
  EXPECT_EQ(image.values, expected);
  EXPECT_EQ(decoded(head(1, 1) + "\x01\x02\x03\xFF").values[0], std::ldexp(1.0f, 119));
}

TEST(RadianceCodec, AllEncodingsHoldTheSamePixels) {
  for (const int width : {8, 37, 300}) {
    const Image image = steps(width, 5);
    const Image flat = decoded(test::hdr_file(image)), packed = decoded(by_channels(image));
    EXPECT_EQ(flat.values, packed.values) << width;
  }
  // A pixel, itself twice more, then 256 times.
  std::string runs = head(259, 1) + "\x80\x40\x20\x81";
  runs += std::string("\x01\x01\x01\x02\x01\x01\x01\x01", 8);
  const Image image = decoded(runs);
  for (int x = 0; x < 259; ++x) EXPECT_EQ(image.at(x, 0)[0], 1.0f) << x;
}

TEST(RadianceCodec, RowsMayComeFromTheBottom) {
  const std::string pixels = "\x80\x80\x80\x81\xC0\xC0\xC0\x81";
  EXPECT_EQ(decoded(head(1, 2) + pixels).at(0, 0)[0], 1.0f);
  EXPECT_EQ(decoded(head(1, 2, "+") + pixels).at(0, 0)[0], 1.5f);
}

TEST(RadianceCodec, ExrBytesEqualTheFiles) {
  const test::TemporaryFolder folder;
  const Image image = steps(12, 6);
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 3; ++c)
    channels.push_back({std::string(1, "RGB"[c]), ExrChannel::Type::kFloat, image.values.data() + c, 3});
  for (const auto compression : {ExrCompression::kPiz, ExrCompression::kZip, ExrCompression::kNone}) {
    write_exr(folder / "sky.exr", 12, 6, channels, compression);
    const std::string bytes = test::read_text(folder / "sky.exr");
    EXPECT_EQ(decoded(bytes).values, image.values);
    for (std::size_t length = 0; length < bytes.size(); length += 3)
      EXPECT_FALSE(fault_of(bytes.substr(0, length)).empty()) << length;
  }
  write_exr(folder / "grey.exr", 12, 6, {{"Y", ExrChannel::Type::kHalf, image.values.data(), 3}});
  EXPECT_EQ(fault_of(test::read_text(folder / "grey.exr")), "channels has no channel R");
}

TEST(RadianceCodec, EveryTruncationIsRefused) {
  const Image image = steps(9, 4);
  for (const std::string& whole : {test::hdr_file(image), by_channels(image)})
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_FALSE(fault_of(whole.substr(0, length)).empty()) << length;
}

TEST(RadianceCodec, FaultsAreNamed) {
  EXPECT_EQ(fault_of("no image"), "is neither OpenEXR nor Radiance HDR");
  EXPECT_EQ(fault_of(""), "is neither OpenEXR nor Radiance HDR");
  EXPECT_EQ(fault_of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n"), "has colours that are not 32-bit_rle_rgbe");
  for (const char* resolution :
       {"+X 1 -Y 1", "-Y 0 +X 1", "-Y -1 +X 1", "-Y 1 +X", "-Y 1 +X 1 ", "-Y 99999999999 +X 1"})
    EXPECT_EQ(fault_of(fmt::format("#?RGBE\n\n{}\n", resolution)), "has a resolution other than -Y height +X width")
        << resolution;
  const std::string longer = head(8, 1) + std::string("\x02\x02\x00\x09", 4) + std::string(90, '\x01');
  EXPECT_EQ(fault_of(longer), "has a broken row 0, or ends there");
  EXPECT_EQ(fault_of(head(4, 1) + "\x01\x01\x01\x04"), "has a broken row 0, or ends there") << "repeats nothing";
}

TEST(RadianceCodec, LimitsAreMetBeforePixelsAreAllocated) {
  Image image;
  std::string fault;
  EXPECT_THROW(decode_radiance(bytes_of(head(16385, 1) + "....."), {}, image, fault), LimitError);
  ImageLimits few;
  few.max_pixels = 15;
  EXPECT_THROW(decode_radiance(bytes_of(head(8, 2) + std::string(64, 'x')), few, image, fault), LimitError);
  const std::string little = head(16384, 8192) + "1234";
  EXPECT_EQ(fault_of(little), fmt::format("of 16384x8192 pixels cannot fit {} bytes", little.size()));
  struct Refused {};
  const auto charge = [](std::uint64_t bytes) {
    if (bytes > 1 << 20) throw Refused();
  };
  EXPECT_THROW(decode_radiance(bytes_of(head(16384, 1024) + std::string(4096, 'x')), {}, image, fault, charge),
               Refused);
  EXPECT_TRUE(image.values.empty());
}

}  // namespace
}  // namespace tessera::radiance_codec_test
