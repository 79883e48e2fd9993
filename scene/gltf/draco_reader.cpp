#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>

#include "base/parallel.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/document.h"
#include "scene/gltf/read_ahead.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// Sizes in the head of a Draco mesh stream (bit-stream 2.2), read before the decoder allocates by them.
struct StreamHead {
  bool edgebreaker = false;
  std::uint64_t faces = 0, points = 0;
  std::uint64_t seams = 0;  // edgebreaker: attributes with a connectivity of their own
};

// Walks over bytes; past the end every read fails and `ok` stays false.
struct Cursor {
  Bytes bytes;
  std::size_t at = 0;
  bool ok = true;

  std::uint8_t byte() {
    if (at >= bytes.size()) ok = false;
    return ok ? bytes[at++] : 0;
  }
  void skip(std::uint64_t count) {
    if (count > bytes.size() - at)
      ok = false;
    else
      at += count;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 63; shift += 7) {
      const std::uint8_t b = byte();
      value |= std::uint64_t{b & 0x7Fu} << shift;
      if ((b & 0x80) == 0) return value;
    }
    ok = false;
    return 0;
  }
};

// Skips the entries of one metadata element and of those inside it (Draco bit-stream, section 5).
void skip_metadata(Cursor& cursor) {
  std::vector<std::uint64_t> left = {1};  // elements still to come, by level
  while (!left.empty() && cursor.ok) {
    if (left.back() == 0) {
      left.pop_back();
      continue;
    }
    --left.back();
    if (left.size() > 1) cursor.skip(cursor.byte());  // the name of an inner element
    for (std::uint64_t entries = cursor.varint(); entries > 0 && cursor.ok; --entries) {
      cursor.skip(cursor.byte());
      cursor.skip(cursor.varint());
    }
    left.push_back(cursor.varint());
  }
}

StreamHead read_head(Bytes stream, const Place& place) {
  constexpr int kMetadataFlag = 0x8000;
  if (stream.size() < 11 || std::memcmp(stream.data(), "DRACO", 5) != 0) place.refuse("is not a Draco stream");
  // The extension's text names this version alone; older ones are decoded by code that trusts their counts.
  if (stream[5] != 2 || stream[6] != 2)
    place.refuse("is Draco bit-stream {}.{}, the extension defines 2.2", stream[5], stream[6]);
  if (stream[7] != draco::TRIANGULAR_MESH) place.refuse("is not a Draco mesh");
  if (stream[8] > draco::MESH_EDGEBREAKER_ENCODING) place.refuse("has a Draco method that does not exist");
  StreamHead head;
  head.edgebreaker = stream[8] == draco::MESH_EDGEBREAKER_ENCODING;
  Cursor cursor{stream, 11};
  if (((stream[9] + stream[10] * 256) & kMetadataFlag) != 0) {
    for (std::uint64_t attributes = cursor.varint(); attributes > 0 && cursor.ok; --attributes) {
      cursor.varint();  // the attribute's id
      skip_metadata(cursor);
    }
    skip_metadata(cursor);
  }
  if (head.edgebreaker) {
    cursor.byte();  // traversal
    head.points = cursor.varint();
    head.faces = cursor.varint();
    head.seams = cursor.byte();
  } else {
    head.faces = cursor.varint();
    head.points = cursor.varint();
  }
  if (!cursor.ok) place.refuse("Draco stream is cut off inside its head");
  return head;
}

// Charges the attributes' values when their forms are known, before they are decoded.
template <class Decoder>
class ChargingDecoder final : public Decoder {
 public:
  ChargingDecoder(MemoryBudget& budget, const Place& place) : budget_(budget), place_(place) {}

 protected:
  bool DecodeAllAttributes() override {
    const draco::PointCloud& cloud = *this->point_cloud();
    // Charges, for each attribute, its values, the integers they are decoded from, the prediction's copies and the
    // point map.
    for (int a = 0; a < cloud.num_attributes(); ++a)
      budget_.charge(cloud.num_points(),
                     2 * static_cast<std::uint64_t>(cloud.attribute(a)->byte_stride()) +
                         16 * cloud.attribute(a)->num_components() + 32,
                     place_.pointer());
    return Decoder::DecodeAllAttributes();
  }

 private:
  MemoryBudget& budget_;
  const Place& place_;
};

std::pair<std::int64_t, std::int64_t> integer_range(int component_type) {
  switch (component_type) {
    case kByte:
      return {-128, 127};
    case kUnsignedByte:
      return {0, 255};
    case kShort:
      return {-32768, 32767};
    case kUnsignedShort:
      return {0, 65535};
    default:
      return {0, 0xFFFFFFFFll};
  }
}

// Finite floats of points that all have a value, on all threads. False: not all are such.
bool copy_floats(const draco::Mesh& mesh, const draco::PointAttribute& attribute, std::size_t components, float* out) {
  constexpr std::uint32_t kChunkPoints = 1 << 16;
  const std::uint32_t count = mesh.num_points();
  std::atomic<bool> sound = true;
  parallel_for((count + kChunkPoints - 1) / kChunkPoints, [&](std::size_t chunk) {
    const auto first = static_cast<std::uint32_t>(chunk) * kChunkPoints;
    bool all = true;
    for (std::uint32_t point = first; point < std::min(count, first + kChunkPoints); ++point) {
      const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(point));
      if (index.value() >= attribute.size()) {
        sound = false;
        return;
      }
      float* const to = out + point * components;
      std::memcpy(to, attribute.GetAddress(index), components * sizeof(float));
      for (std::size_t c = 0; c < components; ++c) all &= std::isfinite(to[c]);
    }
    if (!all) sound = false;
  });
  return sound;
}

// Scalars of one decoded attribute, per point, read as the accessor says.
std::vector<float> attribute_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                    const AccessorLayout& layout, const Place& place) {
  const auto components = static_cast<std::size_t>(layout.components);
  const bool is_float = attribute.data_type() == draco::DT_FLOAT32;
  const std::pair<std::int64_t, std::int64_t> range = integer_range(layout.component_type);
  std::vector<float> values(mesh.num_points() * components);
  if (is_float && copy_floats(mesh, attribute, components, values.data())) return values;
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
        if (integers[c] < range.first || integers[c] > range.second)
          place.refuse("point {} of the Draco stream has the value {}, which its accessor's type cannot hold", point,
                       integers[c]);
      for (std::size_t c = 0; c < components; ++c)
        out[c] = layout.normalized ? dequantize(integers[c], layout.component_type) : static_cast<float>(integers[c]);
    }
    for (std::size_t c = 0; c < components; ++c)
      if (!std::isfinite(out[c])) place.refuse("point {} of the Draco stream is not a finite number", point);
  }
  return values;
}

template <class Decoder>
draco::Status decode_with(Bytes stream, draco::Mesh& mesh, MemoryBudget& budget, const Place& place) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(stream.data()), stream.size());
  ChargingDecoder<Decoder> decoder(budget, place);
  return decoder.Decode(draco::DecoderOptions(), &buffer, &mesh);
}

std::unique_ptr<draco::Mesh> decode(Bytes stream, std::uint64_t declared_faces, std::uint64_t declared_points,
                                    MemoryBudget& budget, const Place& place) {
  const StreamHead head = read_head(stream, place);
  if (head.faces > declared_faces)
    place.refuse("Draco stream says {} triangles, the accessor of the indices {}", head.faces, declared_faces);
  // More points than declared come from attributes that were split at seams: at most one for each corner.
  if (head.points > std::max(3 * head.faces, declared_points))
    place.refuse("Draco stream says {} points for {} triangles", head.points, head.faces);
  // Charges faces and indices; for edgebreaker the tables of corners and vertices and the tables of each seam; then
  // tables by the length of the stream.
  budget.charge(head.faces + head.points, head.edgebreaker ? 120 + 40 * head.seams : 32, place);
  budget.charge(stream.size(), 64, place);
  auto mesh = std::make_unique<draco::Mesh>();
  const draco::Status status = head.edgebreaker
                                   ? decode_with<draco::MeshEdgebreakerDecoder>(stream, *mesh, budget, place)
                                   : decode_with<draco::MeshSequentialDecoder>(stream, *mesh, budget, place);
  if (!status.ok()) place.refuse("Draco stream cannot be decoded ({})", status.error_msg_string());
  return mesh;
}

}  // namespace

const std::vector<float>* DecodedMesh::find(const std::string& name) const {
  for (const auto& [key, values] : attributes)
    if (key == name) return &values;
  return nullptr;
}

DecodedMesh decode_draco(Bytes stream, const DracoRequest& request, MemoryBudget& budget, const Place& place) {
  const std::unique_ptr<draco::Mesh> mesh = decode(stream, request.faces, request.points, budget, place);
  if (mesh->num_faces() == 0 || mesh->num_points() == 0) place.refuse("Draco stream holds no triangles");

  budget.charge(mesh->num_faces(), 12, place);
  DecodedMesh out;
  out.vertex_count = mesh->num_points();
  out.indices.reserve(std::size_t{mesh->num_faces()} * 3);
  for (std::uint32_t f = 0; f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(f))) {
      if (corner.value() >= mesh->num_points()) place.refuse("Draco stream has a corner outside its points");
      out.indices.push_back(corner.value());
    }
  for (const DracoRequest::Attribute& wanted : request.attributes) {
    const Place at = place.at("attributes").at(wanted.name);
    const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(wanted.id);
    if (attribute == nullptr) at.refuse("is id {}, which the Draco stream does not have", wanted.id);
    if (attribute->num_components() != wanted.layout.components)
      at.refuse("has {} components in the Draco stream, {} in its accessor", attribute->num_components(),
                wanted.layout.components);
    const bool is_float = attribute->data_type() == draco::DT_FLOAT32;
    if (is_float != (wanted.layout.component_type == kFloat) ||
        !(is_float || draco::IsDataTypeIntegral(attribute->data_type())))
      at.refuse("is of another component type in the Draco stream than in its accessor");
    budget.charge(out.vertex_count, static_cast<std::uint64_t>(wanted.layout.components) * 4, at);
    out.attributes.emplace_back(wanted.name, attribute_values(*mesh, *attribute, wanted.layout, at));
  }
  return out;
}

DracoRequest draco_request(const Document& document, const json& primitive) {
  const json& extension = *find_extension(primitive, "KHR_draco_mesh_compression");
  const std::uint64_t indices = document.layouts[primitive["indices"].get<std::size_t>()].count;
  const auto layout = [&](const json& accessor) { return document.layouts[accessor.get<std::size_t>()]; };
  DracoRequest request;
  request.faces = primitive.value("mode", 4) == 5 ? indices : indices / 3;
  for (const auto& [name, accessor] : primitive["attributes"].items())
    request.points = std::max(request.points, layout(accessor).count);
  for (const auto& [name, id] : extension["attributes"].items())
    request.attributes.push_back({name, id.get<std::uint32_t>(), layout(primitive["attributes"][name])});
  return request;
}

DecodedMesh read_draco(Document& document, const json& primitive, const Place& place) {
  const json& extension = *find_extension(primitive, "KHR_draco_mesh_compression");
  const Bytes stream = document.resources.buffer_view(extension["bufferView"].get<std::size_t>());
  if (document.ahead != nullptr)
    if (std::optional<DecodedMesh> ready = document.ahead->draco.take(&primitive, document.budget))
      return std::move(*ready);
  return decode_draco(stream, draco_request(document, primitive), document.budget,
                      place.at("extensions").at("KHR_draco_mesh_compression"));
}

}  // namespace tessera::scene::gltf
