#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"

namespace tessera {

// Size of a JPEG's image, its channels as they are decoded (1 grey, 3 colour), and those it stores: 4 are CMYK or YCCK.
struct JpegHeader {
  int width = 0, height = 0, channels = 0, stored_channels = 0;
  bool inverted = false;  // of four channels: 255 is no ink, as Adobe's programs write them
};

// libjpeg-turbo, with its exact integer transformation: the same bits with and without SIMD. Whatever it warns of is a
// fault, too. False with `fault` set where the bytes are no JPEG that can be decoded. CMYK becomes RGB as browsers do it
// without a profile: each colour is what cyan, magenta or yellow and then black let through, to the nearest 1/255.
[[nodiscard]] bool read_jpeg_header(std::span<const std::uint8_t> bytes, JpegHeader& header, std::string& fault);
[[nodiscard]] bool decode_jpeg(std::span<const std::uint8_t> bytes, const JpegHeader& header, Image8& image,
                               std::string& fault);

}  // namespace tessera
