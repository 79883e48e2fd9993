#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/image.h"
#include "base/image_codec.h"

namespace tessera {

// Format of a file of radiance, from its signature alone.
enum class RadianceFormat { kUnknown, kExr, kHdr };
RadianceFormat radiance_format(std::span<const std::uint8_t> bytes);
// "image/x-exr", "image/vnd.radiance"; empty for kUnknown.
const char* mime_type(RadianceFormat format);

// Unpacks an image of linear light, the first row at the top: OpenEXR (base/exr_file.h) or Radiance's RGBE (Ward 1991,
// "Real pixels"; flat and both run-length encodings, rows from the top or the bottom). An RGBE channel is byte * 2^(exponent - 136);
// its EXPOSURE and PRIMARIES are not applied. Returns and throws as decode_image().
bool decode_radiance(std::span<const std::uint8_t> bytes, const ImageLimits& limits, Image& image, std::string& fault,
                     const ChargeBytes& charge = {});

}  // namespace tessera
