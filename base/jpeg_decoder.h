#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"

namespace tessera {

// Size of a JPEG's image and its channels: 1 grey, 3 colour.
struct JpegHeader {
  int width = 0, height = 0, channels = 0;
};

// libjpeg-turbo, with its exact integer transformation: the same bits with and without SIMD. Whatever it warns of is a
// fault, too. False with `fault` set where the bytes are no JPEG that can be decoded; of four channels (CMYK) none is.
[[nodiscard]] bool read_jpeg_header(std::span<const std::uint8_t> bytes, JpegHeader& header, std::string& fault);
[[nodiscard]] bool decode_jpeg(std::span<const std::uint8_t> bytes, const JpegHeader& header, Image8& image,
                               std::string& fault);

}  // namespace tessera
