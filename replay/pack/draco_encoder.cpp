#include "replay/pack/draco_encoder.h"

#include <cstring>
#include <memory>

#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include "base/error.h"
#include "scene/gltf/accessor_layout.h"

namespace tessera::replay {
namespace {

namespace gltf = scene::gltf;

draco::DataType data_type(int component_type) {
  switch (component_type) {
    case gltf::kByte:
      return draco::DT_INT8;
    case gltf::kUnsignedByte:
      return draco::DT_UINT8;
    case gltf::kShort:
      return draco::DT_INT16;
    case gltf::kUnsignedShort:
      return draco::DT_UINT16;
    case gltf::kUnsignedInt:
      return draco::DT_UINT32;
    default:
      return draco::DT_FLOAT32;
  }
}

struct AttributeClass {
  draco::GeometryAttribute::Type type;
  int QuantizationBits::*bits;
};
AttributeClass class_of(const std::string& name) {
  if (name == "POSITION") return {draco::GeometryAttribute::POSITION, &QuantizationBits::position};
  if (name == "NORMAL") return {draco::GeometryAttribute::NORMAL, &QuantizationBits::normal};
  if (name.starts_with("TEXCOORD_")) return {draco::GeometryAttribute::TEX_COORD, &QuantizationBits::texcoord};
  if (name.starts_with("COLOR_")) return {draco::GeometryAttribute::COLOR, &QuantizationBits::color};
  return {draco::GeometryAttribute::GENERIC, &QuantizationBits::generic};
}

// The value of one vertex in the attribute's own component type.
std::vector<std::uint8_t> raw_value(const DracoAttribute& attribute, std::size_t vertex) {
  const std::uint64_t size = gltf::component_bytes(attribute.component_type);
  const auto components = static_cast<std::size_t>(attribute.components);
  std::vector<std::uint8_t> bytes(size * components);
  for (std::size_t c = 0; c < components; ++c) {
    const float value = attribute.values[vertex * components + c];
    if (attribute.component_type == gltf::kFloat) {
      std::memcpy(&bytes[c * size], &value, sizeof value);
    } else {
      const auto integer = static_cast<std::int64_t>(value);
      std::memcpy(&bytes[c * size], &integer, size);  // little endian, two's complement
    }
  }
  return bytes;
}

int add_attribute(draco::Mesh& mesh, const DracoAttribute& attribute, std::size_t vertex_count) {
  const draco::DataType type = data_type(attribute.component_type);
  draco::GeometryAttribute form;
  form.Init(class_of(attribute.name).type, nullptr, static_cast<std::uint8_t>(attribute.components), type,
            attribute.normalized, draco::DataTypeLength(type) * attribute.components, 0);
  const int id = mesh.AddAttribute(form, true, static_cast<std::uint32_t>(vertex_count));
  for (std::size_t v = 0; v < vertex_count; ++v)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(v)),
                                          raw_value(attribute, v).data());
  return id;
}

}  // namespace

DracoOutput encode_draco(const DracoInput& input, const QuantizationBits& bits, bool sequential) {
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<std::uint32_t>(input.vertex_count));
  mesh.SetNumFaces(input.indices.size() / 3);
  for (std::size_t f = 0; f < input.indices.size() / 3; ++f) {
    draco::Mesh::Face face;
    for (std::size_t k = 0; k < 3; ++k) face[k] = draco::PointIndex(input.indices[3 * f + k]);
    mesh.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(f)), face);
  }
  std::vector<int> ids;
  for (const DracoAttribute& attribute : input.attributes)
    ids.push_back(add_attribute(mesh, attribute, input.vertex_count));
  if (!sequential) {
    mesh.DeduplicateAttributeValues();
    mesh.DeduplicatePointIds();
  }

  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(3, 3);
  encoder.SetEncodingMethod(sequential ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  for (std::size_t a = 0; a < ids.size(); ++a)
    if (input.attributes[a].component_type == gltf::kFloat)
      encoder.SetAttributeQuantization(ids[a], bits.*class_of(input.attributes[a].name).bits);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) throw SystemError(fmt::format("Draco cannot compress the mesh: {}", status.error_msg_string()));

  DracoOutput out;
  out.bytes.assign(buffer.data(), buffer.data() + buffer.size());
  for (const int id : ids) out.unique_ids.push_back(static_cast<int>(mesh.attribute(id)->unique_id()));
  return out;
}

}  // namespace tessera::replay
