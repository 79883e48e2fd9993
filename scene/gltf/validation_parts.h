#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/json_reader.h"
#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"

namespace tessera::scene::gltf::validation {

// What the parts of validate_links() share. All take documents that passed check_schema().

// What an accessor must look like for a use: number of components and component types.
struct Format {
  std::vector<int> components;
  std::vector<int> plain;       // component types allowed without normalisation
  std::vector<int> normalized;  // component types allowed with it
};
void check_format(const nlohmann::json& d, std::size_t accessor, const Format& format, const Place& place);

// Morph targets of a mesh: those of its primitive with the most of them.
std::size_t target_count(const nlohmann::json& mesh);

void check_meshes(const nlohmann::json& d, const Place& root, Notes& notes);      // mesh_validation.cpp
void check_animations(const nlohmann::json& d, const Place& root, Notes& notes);  // animation_validation.cpp

}  // namespace tessera::scene::gltf::validation
