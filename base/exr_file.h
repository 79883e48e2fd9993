#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/image_codec.h"

namespace tessera {

// One channel of an EXR file, taken from any strided memory.
struct ExrChannel {
  enum class Type { kHalf, kFloat, kUint };
  std::string name;              // "R", "depth.Z", "patch.id": a layer prefix groups channels in viewers
  Type type = Type::kHalf;       // as stored; kHalf converts from float
  const void* values = nullptr;  // float for kHalf and kFloat, std::uint32_t for kUint
  std::size_t stride = 1;        // elements from pixel to pixel; rows follow each other without gaps
};

// All of them are lossless.
enum class ExrCompression : std::uint8_t { kPiz, kZip, kZips, kRle, kNone };

// Writes a scan-line EXR file, whole or not at all. Throws WriteError.
void write_exr(const std::filesystem::path& target, int width, int height, const std::vector<ExrChannel>& channels,
               ExrCompression compression = ExrCompression::kPiz);

// Reads R, G, B (and A when present) of the first part as linear floats. Throws InputError when the file is not such an
// EXR, and LimitError, before the pixels are allocated, when it is larger than the limits.
Image read_exr(const std::filesystem::path& source, const ImageLimits& limits = {});

// Reads an EXR from bytes in memory. Like decode_image() it returns false with the fault in words, and throws
// LimitError.
bool decode_exr(std::span<const std::uint8_t> bytes, const ImageLimits& limits, Image& image, std::string& fault,
                const ChargeBytes& charge = {});

}  // namespace tessera
