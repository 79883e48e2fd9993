#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/gltf/notes.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

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
