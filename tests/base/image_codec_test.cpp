#include "base/image_codec.h"

#include <png.h>

#include "base/error.h"
#include "base/random.h"
#include "captures/sources/jpeg_writer.h"
#include "tests/support/tests.h"

namespace tessera::image_codec_test {
namespace {

using captures::encode_jpeg;

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

// ---- PNG by libpng's writer -------------------------------------------------------------------------------------

// A kind of PNG: rows of random bits, a palette of random colours where that is the kind. `transparent`: the palette's
// first half, or the colour of the first pixel.
struct PngKind {
  int color_type, depth;
  bool interlaced, transparent;

  std::size_t samples() const {
    return std::array<std::size_t, 7>{1, 0, 3, 1, 2, 0, 4}[static_cast<std::size_t>(color_type)];
  }
};
constexpr int kPngWidth = 21, kPngHeight = 13;

std::vector<PngKind> png_kinds() {
  std::vector<PngKind> kinds;
  for (const auto& [type, depths] :
       std::vector<std::pair<int, std::vector<int>>>{{PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16}},
                                                     {PNG_COLOR_TYPE_PALETTE, {1, 2, 4, 8}},
                                                     {PNG_COLOR_TYPE_RGB, {8, 16}},
                                                     {PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16}},
                                                     {PNG_COLOR_TYPE_RGB_ALPHA, {8, 16}}})
    for (const int depth : depths)
      for (const bool interlaced : {false, true})
        for (const bool transparent : {false, true})
          if (!transparent || (type & PNG_COLOR_MASK_ALPHA) == 0)
            kinds.push_back({type, depth, interlaced, transparent});
  return kinds;
}

class PngFile {
 public:
  explicit PngFile(const PngKind& kind)
      : kind_(kind), row_((kPngWidth * static_cast<int>(kind.samples()) * kind.depth + 7) / 8) {
    for (int i = 0; i < row_ * kPngHeight; ++i)
      bits_.push_back(static_cast<std::uint8_t>(mix32(static_cast<std::uint32_t>(i))));
    for (std::uint32_t i = 0; i < palette_.size(); ++i)
      palette_[i] = {static_cast<png_byte>(mix32(3 * i)), static_cast<png_byte>(mix32(3 * i + 1)),
                     static_cast<png_byte>(mix32(3 * i + 2))};
    for (std::uint32_t i = 0; i < alpha_.size(); ++i) alpha_[i] = static_cast<png_byte>(mix32(1000 + i));
  }

  // With chunks about gamma and profiles, which change nothing.
  std::string bytes() {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    std::string out;
    const auto append = [](png_structp to, png_bytep data, std::size_t size) {
      static_cast<std::string*>(png_get_io_ptr(to))->append(reinterpret_cast<const char*>(data), size);
    };
    png_set_write_fn(png, &out, append, [](png_structp) {});
    png_set_IHDR(png, info, kPngWidth, kPngHeight, kind_.depth, kind_.color_type,
                 kind_.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_gAMA(png, info, 0.25);
    const png_color_8 significant{3, 3, 3, 3, 3};
    if (kind_.depth >= 8) png_set_sBIT(png, info, &significant);
    if (palette()) png_set_PLTE(png, info, palette_.data(), 1 << kind_.depth);
    png_color_16 color{0, sample(0, 0, 0), sample(0, 0, 1), sample(0, 0, 2), sample(0, 0, 0)};
    if (kind_.transparent) png_set_tRNS(png, info, alpha_.data(), palette() ? (1 << kind_.depth) / 2 : 0, &color);
    std::vector<png_bytep> rows;
    for (int y = 0; y < kPngHeight; ++y) rows.push_back(bits_.data() + y * row_);
    png_set_rows(png, info, rows.data());
    png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
    png_destroy_write_struct(&png, &info);
    return out;
  }

  bool palette() const { return kind_.color_type == PNG_COLOR_TYPE_PALETTE; }
  // As stored; 0 for channels that there are not.
  std::uint16_t sample(int x, int y, std::size_t channel) const {
    if (channel >= kind_.samples()) return 0;
    const std::size_t bit =
        (static_cast<std::size_t>(x) * kind_.samples() + channel) * static_cast<std::size_t>(kind_.depth);
    const std::uint8_t* at = bits_.data() + y * row_ + bit / 8;
    if (kind_.depth == 16) return static_cast<std::uint16_t>(at[0] << 8 | at[1]);
    return static_cast<std::uint16_t>(at[0] >> (8 - bit % 8 - static_cast<std::size_t>(kind_.depth)) &
                                      ((1 << kind_.depth) - 1));
  }
  // Follows the PNG specification: sections 12.5 and 13.12 widen samples, 11.3.2 defines transparent pixels.
  std::vector<int> pixel(int x, int y) const {
    const int largest = kind_.depth == 16 ? 65535 : 255;
    if (palette()) {
      const std::size_t index = sample(x, y, 0);
      std::vector<int> out = {palette_[index].red, palette_[index].green, palette_[index].blue};
      if (kind_.transparent) out.push_back(index < std::size_t{1} << kind_.depth >> 1 ? alpha_[index] : 255);
      return out;
    }
    std::vector<int> out;
    bool first = true;
    for (std::size_t c = 0; c < kind_.samples(); ++c) {
      out.push_back(kind_.depth >= 8 ? sample(x, y, c) : sample(x, y, c) * 255 / ((1 << kind_.depth) - 1));
      first = first && sample(x, y, c) == sample(0, 0, c);
    }
    if (kind_.transparent) out.push_back(first ? 0 : largest);
    return out;
  }

 private:
  PngKind kind_;
  int row_;
  std::vector<std::uint8_t> bits_;
  std::array<png_color, 256> palette_{};
  std::array<png_byte, 256> alpha_{};
};

TEST(ImageCodec, EveryKindOfPngGivesTheValuesOfTheSpecification) {
  for (const PngKind& kind : png_kinds()) {
    PngFile file(kind);
    const DecodedImage image = decode(file.bytes());
    const std::string name =
        fmt::format("type {} of {} bits{}{}", kind.color_type, kind.depth, kind.interlaced ? ", interlaced" : "",
                    kind.transparent ? ", transparent" : "");
    ASSERT_EQ(std::holds_alternative<Image16>(image.pixels), kind.depth == 16) << name;
    ASSERT_EQ(static_cast<std::size_t>(image.channels()), file.pixel(0, 0).size()) << name;
    int transparent = 0;
    for (int y = 0; y < kPngHeight; ++y)
      for (int x = 0; x < kPngWidth; ++x) {
        const std::vector<int> wanted = file.pixel(x, y);
        const auto got = [&](int c) {
          return std::visit([&](const auto& i) { return int{i.at(x, y)[static_cast<std::size_t>(c)]}; }, image.pixels);
        };
        for (int c = 0; c < image.channels(); ++c)
          ASSERT_EQ(got(c), wanted[static_cast<std::size_t>(c)]) << name << " at " << x << ", " << y;
        transparent += kind.transparent && wanted.back() != (kind.depth == 16 ? 65535 : 255) ? 1 : 0;
      }
    EXPECT_EQ(transparent > 0, kind.transparent) << name;
  }
}

TEST(ImageCodec, EveryTruncatedKindOfPngIsRefused) {
  for (const PngKind& kind : png_kinds()) {
    const std::string whole = PngFile(kind).bytes();
    for (std::size_t length = 0; length < whole.size(); ++length)
      ASSERT_FALSE(fault_of(whole.substr(0, length)).empty()) << kind.color_type << " " << length;
  }
}

TEST(ImageCodec, ATransparentColourOfPixelsWithAlphaIsRefused) {
  std::string png = encode_png(noise_image<std::uint8_t>(4, 4, 4));
  png.insert(33, std::string("\0\0\0\6tRNS\0\0\0\0\0\0\x6E\xA6\x07\x91", 18));
  EXPECT_NE(fault_of(png).find("tRNS"), std::string::npos) << fault_of(png);
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
