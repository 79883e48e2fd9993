#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"

namespace tessera {

// Size of a JPEG's image, its decoded channels (1 grey, 3 colour) and its stored channels: 4 mean CMYK or YCCK.
struct JpegHeader {
  int width = 0, height = 0, channels = 0, stored_channels = 0;
  bool inverted = false;  // with four channels: 255 means no ink, as Adobe's programs write them
};

// Decode with libjpeg-turbo and its exact integer transformation: the same bits with and without SIMD. A warning of the
// library counts as a fault. Return false with `fault` set where the bytes are no JPEG that can be decoded. CMYK
// becomes RGB as in browsers without a profile: each colour is the light that cyan, magenta or yellow and then black
// let through, to the nearest 1/255.
[[nodiscard]] bool read_jpeg_header(std::span<const std::uint8_t> bytes, JpegHeader& header, std::string& fault);
[[nodiscard]] bool decode_jpeg(std::span<const std::uint8_t> bytes, const JpegHeader& header, Image8& image,
                               std::string& fault);

}  // namespace tessera
