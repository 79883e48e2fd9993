#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"

namespace tessera {

// Head of a still WebP: size, 3 or 4 channels, and whether libwebp must hold the whole image to decode it (lossless, or
// lossy with alpha).
struct WebpHeader {
  int width = 0, height = 0, channels = 0;
  bool lossless = false;
};

// Decode with libwebp in exact integer arithmetic: the same bits on every host. The container is checked first (the
// RIFF length, every chunk inside it, one image), because libwebp ignores bytes after the image. Return false with
// `fault` set for damaged and truncated files, and for animations: glTF has still images.
[[nodiscard]] bool read_webp_header(std::span<const std::uint8_t> bytes, WebpHeader& header, std::string& fault);
[[nodiscard]] bool decode_webp(std::span<const std::uint8_t> bytes, const WebpHeader& header, Image8& image,
                               std::string& fault);

// Peak bytes of decode_webp(), the image included, for streams of common encoders. libwebp offers no way to ask in
// advance: a stream made for the purpose can have a group of prefix codes, 20 KiB, for every 16 pixels.
std::uint64_t webp_decoder_bytes(const WebpHeader& header, std::uint64_t encoded_bytes);

// WebP bytes of an 8-bit image with 3 or 4 channels; quality 0 to 100, or lossless, which keeps every byte. Throws
// SystemError with libwebp's reason, sides beyond its 16383 pixels among them.
std::string encode_webp(const Image8& image, int quality, bool lossless);

}  // namespace tessera
