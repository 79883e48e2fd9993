#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "scene/capture.h"
#include "scene/gltf/place.h"
#include "scene/gltf/procedure_builder.h"

namespace tessera::scene::gltf {

// What a pointer of KHR_animation_pointer names, of what Tessera reads.
struct PointerTarget {
  AnimatedPath path;
  int object;      // the node, material, camera or light
  int part;        // of a material: AnimationChannel::part
  int components;  // of a value; of weights 1
  int values;      // of a key; of weights 0: as many as the mesh has
  bool defined;    // the document has the object that holds the property, and the property if it has no default
};

// Nothing for a pointer at anything that is not read. Refuses one at an object that is not there. `document` must have
// passed check_schema(); `programs` keeps what parameters of procedures ask for.
std::optional<PointerTarget> resolve_pointer(const nlohmann::json& document, const std::string& pointer,
                                             ProgramCache& programs, const Place& place);

// The pointer of a channel's target, or null: its path is one of a node's.
const std::string* animation_pointer(const nlohmann::json& channel);

}  // namespace tessera::scene::gltf
