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

// Moves all images of `d` into the chunk. With `webp` it converts PNG and JPEG images of 8 bits, and their textures
// name them by EXT_texture_webp. Heights of 16 bits, displacement textures, images of more than 16383 pixels a side and
// images that WebP would make larger stay as they are. Returns the number of converted images.
std::size_t move_images(scene::gltf::Document& document, nlohmann::json& d, BinaryChunk& chunk,
                        const std::optional<WebpOptions>& webp, std::vector<std::string>& notices);

}  // namespace tessera::replay
