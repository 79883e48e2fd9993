#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/notes.h"
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

// ---- Parts of a document ----------------------------------------------------------------------------------------

// A member of an object, or null.
const nlohmann::json* find(const nlohmann::json& object, std::string_view name);
// The value that a JSON pointer without escapes names in an object; nullptr if there is none.
const nlohmann::json* find_at(const nlohmann::json& object, std::string_view pointer);
// An extension of an object, or null.
const nlohmann::json* find_extension(const nlohmann::json& object, std::string_view name);
// A list of an object, or an empty one.
const nlohmann::json& list_of(const nlohmann::json& object, std::string_view name);

// A glTF file taken apart: the JSON text, and the binary chunk of a .glb.
struct Container {
  std::string json;
  std::vector<std::uint8_t> binary;
  bool has_binary = false;
  std::size_t json_offset = 0;  // byte of the file at which `json` starts, for messages
};

// Tells .glb from .gltf by the magic number and checks the chunk structure of a .glb. Throws InputError.
Container open_container(std::vector<std::uint8_t> bytes, const std::string& file, Notes& notes);
// The same, whose notes nobody asks for.
Container open_container(std::vector<std::uint8_t> bytes, const std::string& file);

}  // namespace tessera::scene::gltf
