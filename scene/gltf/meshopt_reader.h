#pragma once

#include <cstdint>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"
#include "scene/gltf/resources.h"

namespace tessera::scene::gltf {

// Buffer views compressed by KHR_meshopt_compression or EXT_meshopt_compression, whatever reads them: attributes,
// indices, animations, matrices, sparse parts, images. The first decodes what the second does: a stream says its
// version itself.

// The extension of a buffer view under the name that it has, or null; `name` may be null.
const nlohmann::json* find_meshopt(const nlohmann::json& view, const char** name = nullptr);

// Checks what links several objects: sizes and strides by mode and filter, the compressed bytes inside their buffer,
// one name only, and that buffers tagged as fallback are not needed. `document` must have passed check_schema.
void check_meshopt(const nlohmann::json& document, const Place& root);

// The view's byteLength bytes, decoded. `compressed` is what the extension points at, `place` the extension's place.
// Charged before they are allocated.
std::vector<std::uint8_t> read_meshopt(const nlohmann::json& extension, Bytes compressed, MemoryBudget& budget,
                                       const Place& place);

}  // namespace tessera::scene::gltf
