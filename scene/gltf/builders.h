#pragma once

#include <optional>

#include <nlohmann/json_fwd.hpp>

#include "scene/capture.h"
#include "scene/gltf/document.h"
#include "scene/gltf/selection.h"

namespace tessera::scene::gltf {

// Each builder turns one part of a checked document into the capture's form. They throw InputError for values inside
// buffers that glTF forbids, LimitError when the budget does not suffice.
std::vector<Mesh> build_meshes(Document& document);
// One primitive as it is stored (a cage stays a cage), or nothing where there is nothing to draw.
std::optional<Primitive> build_primitive(Document& document, const nlohmann::json& json_primitive, const Place& place);
// An image of a texture; a texture may name several, the preferred one first.
struct TextureImage {
  std::size_t image;
  bool basis;  // KTX2, by KHR_texture_basisu
};
std::vector<TextureImage> images_of(const nlohmann::json& texture);
// Whether a material's shader may read a texture: an unlit material has no extensions, and specular-glossiness replaces
// pbrMetallicRoughness.
bool is_used(const MaterialTextureRow& row, const nlohmann::json& material);
void build_materials(Document& document, Capture& capture);  // and the KTX2 images that they use
// Builds the selected nodes, skins, animations, cameras, lights and settings.
void build_scene(Document& document, const Selected& selected, Capture& capture);

// TESSERA_capture.passes and .attachments of settings that passed check_schema(); nothing where there are no passes.
std::optional<PassGraph> read_passes(const nlohmann::json& settings);

// TESSERA_capture.environment of a checked document in its long form, an object. A number in the file stands for
// {"intensity": number}, the text "uniform" for {"uniform": true}, any other text for {"image": text}. Empty if the
// document has none.
nlohmann::json environment_settings(const nlohmann::json& document);

// Builds the light of the environment: capture.settings and, for an image, capture.environment_image. The unpacked
// image and the tables made from it are charged. Throws InputError for bytes that are no such image, LimitError.
void build_environment(Document& document, Capture& capture);

inline constexpr const char* kSubdivision = "TESSERA_subdivision";

// Refuses a TESSERA_subdivision object that does not fit its primitive, as far as the JSON shows it: mode, attributes,
// number of quads, vertices out of range. `place` is the primitive's place.
void check_subdivision(const nlohmann::json& document, const nlohmann::json& primitive, const Place& place);

// Replaces a primitive of triangles that carries the extension by its patches; leaves others alone. Refuses a cage
// that cannot be refined, at the extension's place.
void subdivide(Document& document, const nlohmann::json& json_primitive, const Place& place, Primitive& primitive);

}  // namespace tessera::scene::gltf
