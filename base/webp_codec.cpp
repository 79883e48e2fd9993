#include "base/webp_codec.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::uint32_t little_endian32(Bytes bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | (std::uint32_t{bytes[at + 1]} << 8) | (std::uint32_t{bytes[at + 2]} << 16) |
         (std::uint32_t{bytes[at + 3]} << 24);
}

// Walks the chunks of a WebP ("WebP Container Specification"): lengths inside the file, one image, no animation.
bool check_container(Bytes bytes, std::string& fault) {
  constexpr std::size_t kHead = 12, kChunkHead = 8;
  if (bytes.size() < kHead + kChunkHead) return fault = "WebP ends inside its head", false;
  const std::size_t riff = little_endian32(bytes, 4);
  if (riff < 4 || riff > bytes.size() - 8)
    return fault = fmt::format("WebP says {} bytes, the file has {}", riff, bytes.size() - 8), false;
  const Bytes file = bytes.first(riff + 8);
  int images = 0;
  for (std::size_t at = kHead; at < file.size();) {
    if (file.size() - at < kChunkHead) return fault = fmt::format("WebP ends inside a chunk at byte {}", at), false;
    const std::string_view type(reinterpret_cast<const char*>(file.data() + at), 4);
    const std::size_t length = little_endian32(file, at + 4);
    if (length > file.size() - at - kChunkHead)
      return fault = fmt::format("WebP chunk at byte {} is longer than the file", at), false;
    if (type == "ANIM" || type == "ANMF") return fault = "is an animated WebP, glTF has still images", false;
    images += type == "VP8 " || type == "VP8L" ? 1 : 0;
    at += kChunkHead + length + length % 2;  // a last chunk of odd length may lack its padding
  }
  if (images != 1) return fault = fmt::format("WebP holds {} images", images), false;
  return true;
}

const char* status_text(VP8StatusCode status) {
  switch (status) {
    case VP8_STATUS_OUT_OF_MEMORY:
      return "out of memory";
    case VP8_STATUS_BITSTREAM_ERROR:
      return "its bit stream is damaged";
    case VP8_STATUS_UNSUPPORTED_FEATURE:
      return "it has a feature that does not exist";
    case VP8_STATUS_NOT_ENOUGH_DATA:
      return "it ends before its last pixel";
    default:
      return "libwebp refuses it";
  }
}

}  // namespace

bool read_webp_header(Bytes bytes, WebpHeader& header, std::string& fault) {
  if (!check_container(bytes, fault)) return false;
  WebPBitstreamFeatures features;
  const VP8StatusCode status = WebPGetFeatures(bytes.data(), bytes.size(), &features);
  if (status != VP8_STATUS_OK) return fault = fmt::format("cannot be decoded ({})", status_text(status)), false;
  if (features.has_animation != 0) return fault = "is an animated WebP, glTF has still images", false;
  header.width = features.width;
  header.height = features.height;
  header.channels = features.has_alpha != 0 ? 4 : 3;
  header.lossless = features.format == 2;
  return true;
}

bool decode_webp(Bytes bytes, const WebpHeader& header, Image8& image, std::string& fault) {
  image = Image8(header.width, header.height, header.channels);
  WebPDecoderConfig config;
  if (WebPInitDecoderConfig(&config) == 0) return fault = "cannot be decoded (another version of libwebp)", false;
  config.output.colorspace = header.channels == 4 ? MODE_RGBA : MODE_RGB;
  config.output.is_external_memory = 1;
  config.output.u.RGBA.rgba = image.values.data();
  config.output.u.RGBA.stride = header.width * header.channels;
  config.output.u.RGBA.size = image.values.size();
  const VP8StatusCode status = WebPDecode(bytes.data(), bytes.size(), &config);
  WebPFreeDecBuffer(&config.output);
  if (status != VP8_STATUS_OK) return fault = fmt::format("cannot be decoded ({})", status_text(status)), false;
  return true;
}

std::uint64_t webp_decoder_bytes(const WebpHeader& header, std::uint64_t encoded_bytes) {
  const auto width = static_cast<std::uint64_t>(header.width), height = static_cast<std::uint64_t>(header.height);
  const std::uint64_t pixels = width * height;
  // Tables of one group of prefix codes, with the largest colour cache. Encoders give one group to a thousand pixels
  // and more, because each costs them its code lengths.
  constexpr std::uint64_t kGroup = 20 << 10, kMaxGroups = 2600;
  const std::uint64_t groups = std::min({pixels / 1024 + 16, kMaxGroups, encoded_bytes / 8 + 1});
  // ARGB, transforms at up to a quarter of the pixels, and 16 rows of output; lossy frames: rows of macroblocks.
  const std::uint64_t whole = header.lossless ? pixels * 5 : header.channels == 4 ? pixels * 2 : 0;
  const bool prefix_codes = header.lossless || header.channels == 4;
  return pixels * static_cast<std::uint64_t>(header.channels) + whole + width * 16 * 16 +
         (prefix_codes ? groups * kGroup : 0) + (64 << 10);
}

std::string encode_webp(const Image8& image, int quality, bool lossless) {
  WebPConfig config;
  WebPPicture frame;
  if (WebPConfigInit(&config) == 0 || WebPPictureInit(&frame) == 0)
    throw SystemError("cannot write WebP: another version of libwebp");
  config.quality = static_cast<float>(lossless ? 75 : quality);
  config.lossless = lossless ? 1 : 0;
  config.exact = 1;  // colours behind transparent pixels stay: filters read them
  frame.use_argb = config.lossless;
  frame.width = image.width;
  frame.height = image.height;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  const std::unique_ptr<WebPMemoryWriter, decltype(&WebPMemoryWriterClear)> free_writer(&writer, WebPMemoryWriterClear);
  const std::unique_ptr<WebPPicture, decltype(&WebPPictureFree)> free_frame(&frame, WebPPictureFree);
  frame.writer = WebPMemoryWrite;
  frame.custom_ptr = &writer;
  const int stride = image.width * image.channels;
  const bool ok = (image.channels == 4 ? WebPPictureImportRGBA(&frame, image.values.data(), stride)
                                       : WebPPictureImportRGB(&frame, image.values.data(), stride)) != 0 &&
                  WebPEncode(&config, &frame) != 0;
  if (!ok)
    throw SystemError(fmt::format("cannot write a WebP of {}x{} pixels: libwebp's error {}", image.width, image.height,
                                  static_cast<int>(frame.error_code)));
  return {reinterpret_cast<const char*>(writer.mem), writer.size};
}

}  // namespace tessera
