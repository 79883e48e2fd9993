#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "frontend/limits.h"

namespace tessera::frontend::gltf {

// A glTF file taken apart: the JSON text, and the binary chunk of a .glb.
struct Container {
  std::string json;
  std::vector<std::uint8_t> binary;
  bool has_binary = false;
  std::size_t json_offset = 0;  // byte of the file at which `json` starts, for messages
};

// Reads a whole regular file. Throws InputError when it is missing, not a regular file or cannot be read, LimitError
// when it is larger than max_bytes or than what `budget` (may be null) has left. `display_name` is what messages call it.
std::vector<std::uint8_t> read_whole_file(const std::filesystem::path& file, std::uint64_t max_bytes,
                                          const std::string& display_name, MemoryBudget* budget = nullptr);

// Tells .glb from .gltf by the magic number and checks the chunk structure of a .glb. Throws InputError.
Container open_container(std::vector<std::uint8_t> bytes, const std::string& file);

}  // namespace tessera::frontend::gltf
