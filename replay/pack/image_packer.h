#pragma once

#include <optional>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "replay/pack/binary_chunk.h"

namespace tessera::replay {

// Quality 0 to 100; none: lossless.
struct WebpOptions {
  std::optional<int> quality = 80;  // [spec] gltf-transform's default
};

enum class Ktx2Format { kNone, kUastc, kEtc1s };

// How images are written anew; at most one of them.
struct ImageOptions {
  std::optional<WebpOptions> webp;
  Ktx2Format ktx2 = Ktx2Format::kNone;
};

struct ImageReport {
  std::size_t webp = 0, ktx2 = 0;  // images that were converted
};

// Moves all images of `d` into the chunk; those that can become what the options ask for do, and their textures name
// them by the extension. Heights of 16 bits and displacement textures stay as they are, and
//   - for WebP (EXT_texture_webp, PNG and JPEG of 8 bits) images beyond its 16383 pixels a side, and those that it
//     would make larger;
//   - for KTX2 (KHR_texture_basisu, with all mip levels) images whose sides are not multiples of 4, that no material
//     uses, or that are colours to one and data to another.
ImageReport move_images(scene::gltf::Document& document, nlohmann::json& d, BinaryChunk& chunk,
                        const ImageOptions& options);

}  // namespace tessera::replay
