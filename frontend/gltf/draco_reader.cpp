#include <cmath>
#include <cstring>

#include <draco/compression/decode.h>

#include "frontend/gltf/accessor_layout.h"
#include "frontend/gltf/document.h"

namespace tessera::frontend::gltf {
namespace {

using nlohmann::json;

// Reads the counts at the head of a Draco mesh stream (bit-stream 2.2), before the decoder allocates by them.
// Returns false when the head is of a form not covered here (older streams, metadata first).
struct StreamHead {
  std::uint64_t faces = 0, points = 0;
};
bool read_head(Bytes stream, StreamHead& head) {
  if (stream.size() < 12 || std::memcmp(stream.data(), "DRACO", 5) != 0) return false;
  const int version = stream[5] * 256 + stream[6], method = stream[8], flags = stream[9] + stream[10] * 256;
  if (version < 2 * 256 + 2 || (flags & 0x8000) != 0) return false;
  std::size_t at = 11;
  const auto varint = [&](std::uint64_t& value) {
    value = 0;
    for (int shift = 0; shift < 63 && at < stream.size(); shift += 7) {
      const std::uint8_t byte = stream[at++];
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if ((byte & 0x80) == 0) return true;
    }
    return false;
  };
  if (method == draco::MESH_SEQUENTIAL_ENCODING) return varint(head.faces) && varint(head.points);
  ++at;  // edgebreaker: traversal type first, then vertices before faces
  return varint(head.points) && varint(head.faces);
}

// Scalars of one decoded attribute, per point, read as the accessor says.
std::vector<float> attribute_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                    const AccessorLayout& layout, const Place& place) {
  const auto components = static_cast<std::size_t>(layout.components);
  const bool is_float = attribute.data_type() == draco::DT_FLOAT32;
  std::vector<float> values(mesh.num_points() * components);
  for (std::uint32_t point = 0; point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(point));
    if (index.value() >= attribute.size()) place.refuse("point {} has no value in the Draco stream", point);
    float* out = &values[point * components];
    if (is_float) {
      attribute.ConvertValue<float>(index, static_cast<std::int8_t>(components), out);
    } else {
      std::int64_t integers[4] = {};
      attribute.ConvertValue<std::int64_t>(index, static_cast<std::int8_t>(components), integers);
      for (std::size_t c = 0; c < components; ++c)
        out[c] = layout.normalized ? dequantize(integers[c], layout.component_type) : static_cast<float>(integers[c]);
    }
    for (std::size_t c = 0; c < components; ++c)
      if (!std::isfinite(out[c])) place.refuse("point {} of the Draco stream is not a finite number", point);
  }
  return values;
}

std::unique_ptr<draco::Mesh> decode(Bytes stream, std::uint64_t declared_faces, MemoryBudget& budget, const Place& place) {
  StreamHead head;
  if (read_head(stream, head)) {
    if (head.faces > declared_faces)
      place.refuse("Draco stream says {} triangles, the accessor of the indices {}", head.faces, declared_faces);
    if (head.points > 3 * head.faces + 16)
      place.refuse("Draco stream says {} points for {} triangles", head.points, head.faces);
  }
  // The decoder's tables take about 100 bytes per triangle.
  budget.charge(declared_faces, 100, place.pointer());
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(stream.data()), stream.size());
  const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
  if (!type.ok() || type.value() != draco::TRIANGULAR_MESH) place.refuse("is not a Draco mesh");
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) place.refuse("Draco stream cannot be decoded ({})", result.status().error_msg_string());
  return std::move(result).value();
}

}  // namespace

const std::vector<float>* DracoMesh::find(const std::string& name) const {
  for (const auto& [key, values] : attributes)
    if (key == name) return &values;
  return nullptr;
}

DracoMesh read_draco(Document& document, const json& primitive, const Place& place) {
  const json& extension = *find_extension(primitive, "KHR_draco_mesh_compression");
  const Place inner = place.at("extensions").at("KHR_draco_mesh_compression");
  const AccessorLayout indices = accessor_layout(document.json, primitive["indices"].get<std::size_t>());
  const Bytes stream = document.resources.buffer_view(extension["bufferView"].get<std::size_t>());
  const bool strip = primitive.value("mode", 4) == 5;
  const std::uint64_t declared_faces = strip ? indices.count : indices.count / 3;
  const std::unique_ptr<draco::Mesh> mesh = decode(stream, declared_faces, document.budget, inner);
  if (mesh->num_faces() == 0 || mesh->num_points() == 0) inner.refuse("Draco stream holds no triangles");

  DracoMesh out;
  out.vertex_count = mesh->num_points();
  out.indices.reserve(std::size_t{mesh->num_faces()} * 3);
  for (std::uint32_t f = 0; f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(f))) {
      if (corner.value() >= mesh->num_points()) inner.refuse("Draco stream has a corner outside its points");
      out.indices.push_back(corner.value());
    }
  for (const auto& [name, id] : extension["attributes"].items()) {
    const Place at = inner.at("attributes").at(name);
    const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(id.get<std::uint32_t>());
    if (attribute == nullptr) at.refuse("is id {}, which the Draco stream does not have", id.dump());
    const AccessorLayout layout = accessor_layout(document.json, primitive["attributes"][name].get<std::size_t>());
    if (attribute->num_components() != layout.components)
      at.refuse("has {} components in the Draco stream, {} in its accessor", attribute->num_components(), layout.components);
    if ((attribute->data_type() == draco::DT_FLOAT32) != (layout.component_type == kFloat))
      at.refuse("is of another component type in the Draco stream than in its accessor");
    document.budget.charge(out.vertex_count, static_cast<std::uint64_t>(layout.components) * 4, at.pointer());
    out.attributes.emplace_back(name, attribute_values(*mesh, *attribute, layout, at));
  }
  return out;
}

}  // namespace tessera::frontend::gltf
