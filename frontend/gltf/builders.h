#pragma once

#include "frontend/capture.h"
#include "frontend/gltf/document.h"

namespace tessera::frontend::gltf {

// Each turns one part of a checked document into the capture's form. They throw InputError for values inside buffers
// that glTF forbids, LimitError when the budget does not suffice.
std::vector<Mesh> build_meshes(Document& document);
std::vector<Material> build_materials(Document& document);
void build_scene(Document& document, Capture& capture);  // nodes, skins, animations, cameras, lights, settings

}  // namespace tessera::frontend::gltf
