#pragma once

#include "scene/capture.h"
#include "scene/gltf/document.h"

namespace tessera::scene::gltf {

// TESSERA_procedure, an extension of nodes: docs/extensions/TESSERA_procedure.md. The names and ranges of parameters
// are those of the stages' declarations (shaders_cpp/procedures/declarations.h).

// Shape of the extension object: known stages, known parameters with the right number of values in their ranges. Throws
// InputError.
void check_procedure_schema(const nlohmann::json& document, const nlohmann::json& procedure, const Place& place);

// What links it to other objects: the accessor of a geometry image. Throws InputError.
void check_procedure_links(const nlohmann::json& document, const nlohmann::json& procedure, const Place& place);

// Procedures of all nodes; sets Node::procedure. Charges what they take.
void build_procedures(Document& document, Capture& capture);

}  // namespace tessera::scene::gltf
