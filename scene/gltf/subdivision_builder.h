#pragma once

#include "scene/capture.h"
#include "scene/gltf/document.h"

namespace tessera::scene::gltf {

inline constexpr const char* kSubdivision = "TESSERA_subdivision";

// Refuses a TESSERA_subdivision object that does not fit its primitive, as far as that shows before anything is
// decoded: mode, attributes, number of quads, vertices out of range. `place` is the primitive's.
void check_subdivision(const nlohmann::json& document, const nlohmann::json& primitive, const Place& place);

// Replaces a primitive of triangles that carries the extension by its patches; leaves others alone. Refuses a cage
// that cannot be refined, at the extension's place.
void subdivide(Document& document, const nlohmann::json& json_primitive, const Place& place, Primitive& primitive);

}  // namespace tessera::scene::gltf
