#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include "base/vec.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"
#include "scene/gltf/resources.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

struct ReadAhead;

// A checked glTF document and everything needed to decode it. `model` is tinygltf's typed view of `json` without its
// buffers and images: tinygltf fills in the defaults, the bytes come from `resources`, which checks them.
struct Document {
  nlohmann::json json;
  tinygltf::Model model;
  Notes notes;
  Resources resources;
  Place root;
  const CaptureLimits& limits;
  MemoryBudget& budget;
  std::vector<AccessorLayout> layouts;  // of the accessors
  std::shared_ptr<ReadAhead> ahead;     // results of read_ahead(); null without it

  Document(nlohmann::json checked, const std::filesystem::path& file, std::vector<std::uint8_t> binary, bool has_binary,
           const CaptureLimits& limits_in, MemoryBudget& budget_in, Notes notes_in = Notes());
};

// ---- Accessors --------------------------------------------------------------------------------------------------

// All scalars of an accessor as floats: sparse values applied, normalised integers mapped to [0, 1] or [-1, 1], other
// integers converted. Refuses NaN and infinity and names the element; where `is_used` returns false, the element
// becomes zero, with a note.
std::vector<float> read_floats(Document& document, std::size_t accessor,
                               const std::function<bool(std::uint64_t)>& is_used = {});

// The same as vectors; the accessor's elements have two or three components.
std::vector<Vec2> read_vec2(Document& document, std::size_t accessor,
                            const std::function<bool(std::uint64_t)>& is_used = {});
std::vector<Vec3> read_vec3(Document& document, std::size_t accessor,
                            const std::function<bool(std::uint64_t)>& is_used = {});

// All scalars of an accessor with an unsigned integer component type.
std::vector<std::uint32_t> read_unsigned(Document& document, std::size_t accessor);

// Value of a normalised integer (glTF 2.0 section 3.6.2.2).
float dequantize(std::int64_t value, int component_type);

// ---- Streams of primitives --------------------------------------------------------------------------------------

// A decoded primitive of KHR_draco_mesh_compression or TESSERA_clusters: triangle list and attributes by glTF name,
// each with as many scalars per vertex as its accessor says.
struct DecodedMesh {
  std::vector<std::uint32_t> indices;
  std::size_t vertex_count = 0;
  std::vector<std::pair<std::string, std::vector<float>>> attributes;
  std::vector<std::uint8_t> triangles_of_cluster;  // of TESSERA_clusters

  const std::vector<float>* find(const std::string& name) const;
};

// Numbers and names that a primitive's accessors state about its Draco stream.
struct DracoRequest {
  struct Attribute {
    std::string name;  // in glTF
    std::uint32_t id;  // in the stream
    AccessorLayout layout;
  };
  std::uint64_t faces = 0, points = 0;  // the stream may not have more
  std::vector<Attribute> attributes;
};

// Decodes a stream. Throws InputError at `place`, the extension's place, where the stream is broken or does not match
// the request.
DecodedMesh decode_draco(Bytes stream, const DracoRequest& request, MemoryBudget& budget, const Place& place);

// The request that a primitive's extension makes of its stream.
DracoRequest draco_request(const Document& document, const nlohmann::json& primitive);

// `primitive` is the primitive's JSON; `place` its place.
DecodedMesh read_draco(Document& document, const nlohmann::json& primitive, const Place& place);

// Returns the TESSERA_clusters extension of a primitive with encoded positions and triangles, else null.
const nlohmann::json* find_encoded_clusters(const nlohmann::json& primitive);
// Decodes such a primitive. Throws InputError where the stream is broken or contradicts the accessors.
DecodedMesh read_clusters(Document& document, const nlohmann::json& primitive, const Place& place);

}  // namespace tessera::scene::gltf
