#pragma once

#include <cstdint>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"
#include "scene/gltf/resources.h"

namespace tessera::scene::gltf {

// Buffer views compressed by KHR_meshopt_compression or EXT_meshopt_compression, for all their readers: attributes,
// indices, animations, matrices, sparse parts, images. The decoder of KHR also decodes EXT, because a stream states its
// version itself.

// The extension of a buffer view under the name that it has, or null; `name` may be null.
const nlohmann::json* find_meshopt(const nlohmann::json& view, const char** name = nullptr);

// Checks the properties that involve several objects: sizes and strides by mode and filter, the compressed bytes inside
// their buffer, one name only, and that buffers tagged as fallback are not needed. `document` must have passed
// check_schema.
void check_meshopt(const nlohmann::json& document, const Place& root);

// Decodes the view's byteLength bytes. `compressed` are the bytes that the extension points at, `place` is the
// extension's place. Bytes are charged before they are allocated.
std::vector<std::uint8_t> read_meshopt(const nlohmann::json& extension, Bytes compressed, MemoryBudget& budget,
                                       const Place& place);

}  // namespace tessera::scene::gltf
