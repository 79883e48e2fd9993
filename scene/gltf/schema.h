#pragma once

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

// Checks the shape of a glTF 2.0 document: every property that Tessera reads has the right type, numbers lie in their
// ranges, enumerations are known, required properties are there, and every index points at something. After this the
// document can be walked without further checks of that kind. What links several objects (accessor ranges, graphs) is
// checked by validate_links. Throws InputError.
void check_schema(const nlohmann::json& document, const Place& root);

}  // namespace tessera::scene::gltf
