#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"

namespace tessera {

// What a still WebP says of itself: size, 3 channels or 4, and whether libwebp must hold the whole image to decode it
// (lossless, or lossy with alpha).
struct WebpHeader {
  int width = 0, height = 0, channels = 0;
  bool lossless = false;
};

// libwebp with exact integer arithmetic: the same bits on every host. The container is checked first (the RIFF length,
// every chunk inside it, one image), because libwebp lets through what follows the image. False with `fault` set for
// damaged and truncated files, and for animations: glTF has still images.
[[nodiscard]] bool read_webp_header(std::span<const std::uint8_t> bytes, WebpHeader& header, std::string& fault);
[[nodiscard]] bool decode_webp(std::span<const std::uint8_t> bytes, const WebpHeader& header, Image8& image,
                               std::string& fault);

// What decode_webp takes at its peak, the image included, for streams that encoders write. libwebp lets nobody ask
// beforehand: a stream made for the purpose can have a group of prefix codes, 20 KiB, for every 16 pixels.
std::uint64_t webp_decoder_bytes(const WebpHeader& header, std::uint64_t encoded_bytes);

// WebP bytes of an 8-bit image with 3 or 4 channels; quality 0 to 100, or lossless, which keeps every byte. Throws
// SystemError with libwebp's reason, sides beyond its 16383 pixels among them.
std::string encode_webp(const Image8& image, int quality, bool lossless);

}  // namespace tessera
