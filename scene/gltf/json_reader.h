#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "scene/limits.h"

namespace tessera::scene::gltf {

// What read_json charges at once for each byte of text, before it looks at any: a hash for each key, which has at least
// five bytes, in a vector that doubles.
inline constexpr std::uint64_t kCensusBytes = 5;

// Parses the JSON of a capture. The text is first read without keeping anything, to charge what the parsed tree and
// its copies will take. Refuses (InputError) with the byte of the file what is not JSON, what nests deeper than 64
// levels and numbers beyond double; with the JSON pointer a key that an object has twice: glTF forbids it, and which
// of the two counts would be anybody's guess. `first_byte`: where the text begins in the file.
nlohmann::json read_json(const std::string& text, std::size_t first_byte, const std::string& file,
                         MemoryBudget& budget);

// Charges what the typed view of a document (tinygltf's) and the capture's own objects take, buffers deferred.
// `document` must have passed check_schema.
void charge_objects(const nlohmann::json& document, MemoryBudget& budget);

}  // namespace tessera::scene::gltf
