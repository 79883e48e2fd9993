#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "scene/capture.h"
#include "scene/gltf/place.h"
#include "scene/gltf/procedure_builder.h"

namespace tessera::scene::gltf {

// Target of a KHR_animation_pointer among the properties that Tessera reads.
struct PointerTarget {
  AnimatedPath path;
  int object;      // the node, material, camera or light
  int part;        // for a material: AnimationChannel::part
  int components;  // of one value; 1 for weights
  int values;      // per key; 0 for weights: as many as the mesh has
  bool defined;    // the document has the object that holds the property, and the property if it has no default
};

// Returns nothing for a pointer at an unread property. Refuses a pointer at a missing object. `document` must have
// passed check_schema(); `programs` caches the compiled programs of procedures.
std::optional<PointerTarget> resolve_pointer(const nlohmann::json& document, const std::string& pointer,
                                             ProgramCache& programs, const Place& place);

// The pointer of a channel's target, or null where its path is a property of a node.
const std::string* animation_pointer(const nlohmann::json& channel);

}  // namespace tessera::scene::gltf
