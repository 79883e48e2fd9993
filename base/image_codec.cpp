#include "base/image_codec.h"

#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/jpeg_decoder.h"
#include "base/webp_codec.h"

namespace tessera {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Walks the marker segments of a JPEG up to the end marker; entropy-coded data is skipped.
bool check_jpeg(Bytes bytes, std::string& fault) {
  std::size_t at = 2;
  bool scan = false;
  while (true) {
    // A marker: 0xFF, any number of fill bytes 0xFF, then its code.
    if (at + 2 > bytes.size()) return fault = "JPEG ends before its end marker", false;
    if (bytes[at] != 0xFF) return fault = fmt::format("JPEG has no marker at byte {}", at), false;
    while (at + 1 < bytes.size() && bytes[at + 1] == 0xFF) ++at;
    if (at + 2 > bytes.size()) return fault = "JPEG ends before its end marker", false;
    const std::uint8_t marker = bytes[at + 1];
    at += 2;
    if (marker == 0xD9) break;                                           // EOI
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;  // no length
    if (at + 2 > bytes.size()) return fault = "JPEG ends inside a segment", false;
    const std::size_t length = (std::size_t{bytes[at]} << 8) | bytes[at + 1];
    if (length < 2 || length > bytes.size() - at)
      return fault = fmt::format("JPEG segment at byte {} is longer than the file", at), false;
    at += length;
    if (marker != 0xDA) continue;
    scan = true;  // after SOS: data up to a marker that is neither a stuffed zero nor a restart
    while (at + 1 < bytes.size() &&
           (bytes[at] != 0xFF || bytes[at + 1] == 0 || (bytes[at + 1] >= 0xD0 && bytes[at + 1] <= 0xD7)))
      ++at;
  }
  if (!scan) return fault = "JPEG holds no pixels", false;
  return true;
}

// Bytes that libjpeg-turbo takes at its peak: planes padded to blocks of up to 32 pixels, coefficients of two bytes when
// progressive, the image, our copy.
std::uint64_t jpeg_decoder_bytes(const JpegHeader& header, std::size_t encoded) {
  const auto padded = [](int side) { return (static_cast<std::uint64_t>(side) + 31) / 32 * 32; };
  constexpr std::uint64_t kTables = 128 << 10;
  return 2 * static_cast<std::uint64_t>(encoded) +
         6 * padded(header.width) * padded(header.height) * static_cast<std::uint64_t>(header.stored_channels) +
         kTables;
}

// Refuses an image beyond the limits.
template <class Header>
void check_limits(const char* format, const Header& header, const ImageLimits& limits) {
  if (header.width > limits.max_side || header.height > limits.max_side ||
      static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height) > limits.max_pixels)
    throw LimitError(fmt::format("{} of {}x{} pixels exceeds the limit of {} a side and {} in all for images", format,
                                 header.width, header.height, limits.max_side, limits.max_pixels));
}

}  // namespace

float DecodedImage::unorm(int x, int y, int channel) const {
  const auto c = static_cast<std::size_t>(channel);
  if (const auto* bytes = std::get_if<Image8>(&pixels)) return static_cast<float>(bytes->at(x, y)[c]) / 255.0f;
  return static_cast<float>(std::get<Image16>(pixels).at(x, y)[c]) / 65535.0f;
}

ImageFormat image_format(Bytes bytes) {
  if (is_png(bytes)) return ImageFormat::kPng;
  if (bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF) return ImageFormat::kJpeg;
  if (bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 && std::memcmp(bytes.data() + 8, "WEBP", 4) == 0)
    return ImageFormat::kWebp;
  return ImageFormat::kUnknown;
}

const char* mime_type(ImageFormat format) {
  switch (format) {
    case ImageFormat::kPng:
      return "image/png";
    case ImageFormat::kJpeg:
      return "image/jpeg";
    case ImageFormat::kWebp:
      return "image/webp";
    case ImageFormat::kUnknown:
      break;
  }
  return "";
}

bool decode_image(Bytes bytes, const ImageLimits& limits, DecodedImage& image, std::string& fault,
                  const ChargeBytes& charge) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return fault = "is larger than 2 GiB", false;
  switch (image_format(bytes)) {
    case ImageFormat::kPng: {
      PngHeader header;
      if (!read_png_header(bytes, header, fault)) return false;
      check_limits("PNG", header, limits);
      if (charge) charge(png_decoder_bytes(header));
      return decode_png(bytes, header, image.pixels, fault);
    }
    case ImageFormat::kJpeg: {
      JpegHeader header;
      if (!check_jpeg(bytes, fault) || !read_jpeg_header(bytes, header, fault)) return false;
      check_limits("JPEG", header, limits);
      if (charge) charge(jpeg_decoder_bytes(header, bytes.size()));
      return decode_jpeg(bytes, header, image.pixels.emplace<Image8>(), fault);
    }
    case ImageFormat::kWebp: {
      WebpHeader header;
      if (!read_webp_header(bytes, header, fault)) return false;
      check_limits("WebP", header, limits);
      if (charge) charge(webp_decoder_bytes(header, bytes.size()));
      return decode_webp(bytes, header, image.pixels.emplace<Image8>(), fault);
    }
    case ImageFormat::kUnknown:
      break;
  }
  return fault = "is neither PNG, JPEG nor WebP", false;
}

void write_png(const std::filesystem::path& target, const Image8& image) {
  write_file_atomically(target, encode_png(image, PngEffort::kFast));
}

}  // namespace tessera
