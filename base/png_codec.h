#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/image.h"

namespace tessera {

// Size of a PNG's image and its channels as they are decoded: a palette becomes colours, a transparent colour alpha,
// and less than 8 bits become 8.
struct PngHeader {
  int width = 0, height = 0, channels = 0;
  bool wide = false;            // 16 bits a channel, else 8
  std::uint64_t raw_bytes = 0;  // of the pixels before compression: every row with its filter byte, Adam7 passes apart
                                // (PNG specification, sections 7.2 and 8)
  std::vector<std::span<const std::uint8_t>> data;  // contents of the IDAT chunks
};

// Whether the bytes begin with PNG's signature.
bool is_png(std::span<const std::uint8_t> bytes);

// Decode with libpng, after a check of our own of all chunks' lengths and checksums and of the amount of compressed
// data. Values are returned as stored: chunks about gamma and profiles are ignored. Return false with `fault` set for
// damaged and truncated files.
[[nodiscard]] bool read_png_header(std::span<const std::uint8_t> bytes, PngHeader& header, std::string& fault);
[[nodiscard]] bool decode_png(std::span<const std::uint8_t> bytes, const PngHeader& header,
                              std::variant<Image8, Image16>& pixels, std::string& fault);

// Bytes that decode_png() takes at its peak, the image included.
std::uint64_t png_decoder_bytes(const PngHeader& header);

// PNG bytes of an 8-bit or 16-bit image with 1 to 4 channels. kFast suits images to look at, kSmall suits shipped ones.
enum class PngEffort : std::uint8_t { kFast, kSmall };
std::string encode_png(const Image8& image, PngEffort effort = PngEffort::kSmall);
std::string encode_png(const Image16& image, PngEffort effort = PngEffort::kSmall);

}  // namespace tessera
