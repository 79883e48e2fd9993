#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <variant>

#include "base/image.h"
#include "base/png_codec.h"

namespace tessera {

// Bounds on the size of an unpacked image; checked before its pixels are allocated.
struct ImageLimits {
  int max_side = 16384;                   // pixels
  std::uint64_t max_pixels = 1ull << 27;  // 128 Mi pixels, 512 MiB as RGBA8
};

// An unpacked PNG, JPEG or WebP with 1 to 4 channels (grey, grey+alpha, RGB, RGBA); 16 bits a channel only from PNG.
struct DecodedImage {
  std::variant<Image8, Image16> pixels;

  int width() const {
    return std::visit([](const auto& image) { return image.width; }, pixels);
  }
  int height() const {
    return std::visit([](const auto& image) { return image.height; }, pixels);
  }
  int channels() const {
    return std::visit([](const auto& image) { return image.channels; }, pixels);
  }
  // Channel value in [0, 1] as stored (no transfer function).
  float unorm(int x, int y, int channel) const;
};

// Format of an image file, from its signature alone.
enum class ImageFormat { kUnknown, kPng, kJpeg, kWebp };
ImageFormat image_format(std::span<const std::uint8_t> bytes);
// "image/png" and so on; empty for kUnknown.
const char* mime_type(ImageFormat format);

// Receives the peak bytes of memory that unpacking needs, before they are allocated; may throw to forbid it.
using ChargeBytes = std::function<void(std::uint64_t)>;

// Unpacks a PNG, JPEG or still WebP. The container is checked first (chunk lengths and CRCs of PNG, marker segments and
// the end marker of JPEG, chunks of WebP, the amount of compressed data of PNG), because the decoders behind it accept
// damaged files.
// Returns false with the fault in words in `fault` when the bytes are not a whole image; throws LimitError when the
// image is larger than the limits.
bool decode_image(std::span<const std::uint8_t> bytes, const ImageLimits& limits, DecodedImage& image,
                  std::string& fault, const ChargeBytes& charge = {});

// Writes a PNG, whole or not at all. Throws WriteError.
void write_png(const std::filesystem::path& target, const Image8& image);

}  // namespace tessera
