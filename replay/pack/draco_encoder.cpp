#include "replay/pack/draco_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
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

// Draco's prediction depends on an attribute's type, and for normals and coordinates it expects integers that Draco
// quantised itself: other integers would be decoded to other values.
draco::GeometryAttribute::Type type_of(const DracoAttribute& attribute) {
  const bool own = attribute.component_type == gltf::kFloat && !attribute.exact;
  return own || attribute.name == "POSITION" ? class_of(attribute.name).type : draco::GeometryAttribute::GENERIC;
}

// Makes Draco keep values on their grid: whole steps from the least one on. Draco divides the range of all values by
// 2^bits - 1 steps; an extra value that no vertex has makes the range exactly so many steps long. (Draco would pass an
// explicit range through a text of six decimals.)
void keep_on_grid(const DracoAttribute& attribute, int id, draco::Mesh& mesh, draco::ExpertEncoder& encoder) {
  const auto components = static_cast<std::size_t>(attribute.components);
  std::vector<float> low(attribute.values.begin(), attribute.values.begin() + attribute.components), high = low;
  for (std::size_t i = 0; i < attribute.values.size(); ++i) {
    low[i % components] = std::min(low[i % components], attribute.values[i]);
    high[i % components] = std::max(high[i % components], attribute.values[i]);
  }
  double steps = 1;
  for (std::size_t c = 0; c < components; ++c)
    steps =
        std::max(steps, std::ldexp(static_cast<double>(high[c]) - static_cast<double>(low[c]), -*attribute.exponent));
  const int bits = std::bit_width(static_cast<std::uint64_t>(steps));
  constexpr int kRoundedByFloats = 23;  // Draco adds a half and cuts it off
  if (bits > kRoundedByFloats) return;
  low[0] = static_cast<float>(static_cast<double>(low[0]) + std::ldexp(std::exp2(bits) - 1, *attribute.exponent));
  draco::PointAttribute& values = *mesh.attribute(id);
  const std::size_t count = values.size();
  values.Resize(count + 1);
  values.SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(count)), low.data());
  encoder.SetAttributeQuantization(id, bits);
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
  form.Init(type_of(attribute), nullptr, static_cast<std::uint8_t>(attribute.components), type, attribute.normalized,
            draco::DataTypeLength(type) * attribute.components, 0);
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
  for (std::size_t a = 0; a < ids.size(); ++a) {
    const DracoAttribute& attribute = input.attributes[a];
    if (attribute.component_type != gltf::kFloat || attribute.exact) continue;
    if (attribute.exponent)
      keep_on_grid(attribute, ids[a], mesh, encoder);
    else
      encoder.SetAttributeQuantization(ids[a], bits.*class_of(attribute.name).bits);
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) throw SystemError(fmt::format("Draco cannot compress the mesh: {}", status.error_msg_string()));

  DracoOutput out;
  out.bytes.assign(buffer.data(), buffer.data() + buffer.size());
  for (const int id : ids) out.unique_ids.push_back(static_cast<int>(mesh.attribute(id)->unique_id()));
  return out;
}

}  // namespace tessera::replay
