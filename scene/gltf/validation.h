#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/json_reader.h"
#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

// Checks the properties that involve several objects of a document that passed check_schema: version and required
// extensions, ranges of views and accessors inside their buffers, the node graph (a forest), formats and counts of
// vertex attributes, indices, morph targets, skins and animations, cameras and lights. Reads no buffer data: the
// decoders check values inside the buffers. Throws InputError at the first fault.
void validate_links(const nlohmann::json& document, const Place& root, Notes& notes);

// Checks the shape of a glTF 2.0 document: every property that Tessera reads has the right type, numbers lie in their
// ranges, enumerations are known, required properties exist, and every index points at something. After this the
// document can be walked without further checks of that kind. validate_links() checks properties that involve several
// objects (accessor ranges, graphs). Throws InputError. A violation of glTF with only one meaning gets a note, and the
// corrected value replaces it in the document.
void check_schema(nlohmann::json& document, const Place& root, Notes& notes);

}  // namespace tessera::scene::gltf

namespace tessera::scene::gltf::validation {

// The parts of validate_links() share these. All take documents that passed check_schema().

// A quaternion whose squared length is below this has no rotation.
inline constexpr double kLeastQuaternion = 1e-6;
// Exporters' rounding leaves up to this in the last row of an affine matrix.
inline constexpr double kMatrixRounding = 1e-5;

// The numbers of components and the component types that a use of an accessor allows.
struct Format {
  std::vector<int> components;
  std::vector<int> plain;       // component types allowed without normalisation
  std::vector<int> normalized;  // component types allowed with it
};
void check_format(const nlohmann::json& d, std::size_t accessor, const Format& format, const Place& place);

// Number of morph targets of a mesh: the largest number among its primitives.
std::size_t target_count(const nlohmann::json& mesh);

void check_meshes(const nlohmann::json& d, const Place& root, Notes& notes);      // mesh_validation.cpp
void check_animations(const nlohmann::json& d, const Place& root, Notes& notes);  // animation_validation.cpp
// Checks TESSERA_capture.attachments and .passes of `settings`; `place` is the place of `settings`: passes_reader.cpp.
void check_passes(const nlohmann::json& settings, const Place& place);

}  // namespace tessera::scene::gltf::validation
