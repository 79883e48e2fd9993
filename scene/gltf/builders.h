#pragma once

#include <optional>

#include "scene/capture.h"
#include "scene/gltf/document.h"
#include "scene/gltf/selection.h"

namespace tessera::scene::gltf {

// Each turns one part of a checked document into the capture's form. They throw InputError for values inside buffers
// that glTF forbids, LimitError when the budget does not suffice.
std::vector<Mesh> build_meshes(Document& document);
// One primitive as it is stored (a cage stays a cage), or nothing where there is nothing to draw.
std::optional<Primitive> build_primitive(Document& document, const nlohmann::json& json_primitive, const Place& place);
// Whether a material's shader may read a texture: an unlit one has no extensions, and specular-glossiness takes the place
// of pbrMetallicRoughness.
bool is_used(const MaterialTextureRow& row, const nlohmann::json& material);
void build_materials(Document& document, Capture& capture);  // and the KTX2 images that they use
// Nodes, skins, animations, cameras, lights, settings; what is drawn of them is what was selected.
void build_scene(Document& document, const Selected& selected, Capture& capture);

}  // namespace tessera::scene::gltf
