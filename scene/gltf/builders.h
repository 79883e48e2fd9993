#pragma once

#include <optional>

#include <nlohmann/json_fwd.hpp>

#include "scene/capture.h"
#include "scene/gltf/document.h"
#include "scene/gltf/selection.h"

namespace tessera::scene::gltf {

// Each turns one part of a checked document into the capture's form. They throw InputError for values inside buffers
// that glTF forbids, LimitError when the budget does not suffice.
std::vector<Mesh> build_meshes(Document& document);
// One primitive as it is stored (a cage stays a cage), or nothing where there is nothing to draw.
std::optional<Primitive> build_primitive(Document& document, const nlohmann::json& json_primitive, const Place& place);
// The images that a texture names, the one to be preferred first.
struct TextureImage {
  std::size_t image;
  bool basis;  // KTX2, by KHR_texture_basisu
};
std::vector<TextureImage> images_of(const nlohmann::json& texture);
// Whether a material's shader may read a texture: an unlit one has no extensions, and specular-glossiness takes the place
// of pbrMetallicRoughness.
bool is_used(const MaterialTextureRow& row, const nlohmann::json& material);
void build_materials(Document& document, Capture& capture);  // and the KTX2 images that they use
// Nodes, skins, animations, cameras, lights, settings; what is drawn of them is what was selected.
void build_scene(Document& document, const Selected& selected, Capture& capture);

// TESSERA_capture.passes and .attachments of settings that passed check_schema(); nothing where there are no passes.
std::optional<PassGraph> read_passes(const nlohmann::json& settings);

// TESSERA_capture.environment of a checked document in its long form, an object; a number is its `intensity`, the text
// "uniform" stands for {"uniform": true}, any other for {"image": text}. Empty where there is none.
nlohmann::json environment_settings(const nlohmann::json& document);

// Builds the light from all around: capture.settings and, of an image, capture.environment_image. The image is
// charged with what it unpacks to and what is made from it. Throws InputError for what is no such image, LimitError.
void build_environment(Document& document, Capture& capture);

inline constexpr const char* kSubdivision = "TESSERA_subdivision";

// Refuses a TESSERA_subdivision object that does not fit its primitive, as far as that shows before anything is
// decoded: mode, attributes, number of quads, vertices out of range. `place` is the primitive's.
void check_subdivision(const nlohmann::json& document, const nlohmann::json& primitive, const Place& place);

// Replaces a primitive of triangles that carries the extension by its patches; leaves others alone. Refuses a cage
// that cannot be refined, at the extension's place.
void subdivide(Document& document, const nlohmann::json& json_primitive, const Place& place, Primitive& primitive);

}  // namespace tessera::scene::gltf
