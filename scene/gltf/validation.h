#pragma once

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

// Checks what links several objects of a document that passed check_schema: version and required extensions, ranges of
// views and accessors inside what holds them, the node graph (a forest), formats and counts of vertex attributes,
// indices, morph targets, skins and animations, cameras and lights. Reads no buffer data: values inside the buffers
// are checked where they are decoded. Throws InputError at the first fault.
void validate_links(const nlohmann::json& document, const Place& root, Notes& notes);

}  // namespace tessera::scene::gltf
