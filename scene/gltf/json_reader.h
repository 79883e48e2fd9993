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

// Bytes that read_json() charges in advance for each byte of text: it keeps a hash for each key, which has at least
// five bytes, in a vector that doubles.
inline constexpr std::uint64_t kCensusBytes = 5;

// Parses the JSON of a capture. A first pass reads the text without keeping anything, to charge the parsed tree and its
// copies. Refuses (InputError) with the byte of the file text that is not JSON, values nested deeper than 64 levels and
// numbers beyond double. Refuses with the JSON pointer a key that an object has twice: glTF forbids it and does not say
// which of the two counts. `first_byte`: offset of the text in the file.
nlohmann::json read_json(const std::string& text, std::size_t first_byte, const std::string& file,
                         MemoryBudget& budget);

// Charges the typed view of a document (tinygltf's) and the capture's own objects, buffers deferred.
// `document` must have passed check_schema.
void charge_objects(const nlohmann::json& document, MemoryBudget& budget);

// ---- Parts of a document ----------------------------------------------------------------------------------------

// A member of an object, or null.
const nlohmann::json* find(const nlohmann::json& object, std::string_view name);
// The value that a JSON pointer without escapes names in an object; nullptr if there is none.
const nlohmann::json* find_at(const nlohmann::json& object, std::string_view pointer);
// An extension of an object, or null.
const nlohmann::json* find_extension(const nlohmann::json& object, std::string_view name);
// A list in an object, or an empty list.
const nlohmann::json& list_of(const nlohmann::json& object, std::string_view name);

// The parts of a glTF file: the JSON text, and the binary chunk of a .glb.
struct Container {
  std::string json;
  std::vector<std::uint8_t> binary;
  bool has_binary = false;
  std::size_t json_offset = 0;  // byte of the file at which `json` starts, for messages
};

// Tells .glb from .gltf by the magic number and checks the chunk structure of a .glb. Throws InputError.
Container open_container(std::vector<std::uint8_t> bytes, const std::string& file, Notes& notes);
// The same without notes.
Container open_container(std::vector<std::uint8_t> bytes, const std::string& file);

}  // namespace tessera::scene::gltf
