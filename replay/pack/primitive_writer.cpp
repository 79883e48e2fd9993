#include "replay/pack/primitive_writer.h"

#include <algorithm>
#include <cstring>

#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/meshopt_reader.h"

namespace tessera::replay {

using nlohmann::json;
namespace gltf = scene::gltf;

EditedAsset::EditedAsset(std::filesystem::path source, json source_document, std::vector<std::uint8_t> chunk,
                         bool has_chunk)
    : document(std::move(source_document)), source_(std::move(source)) {
  json& buffers = document["buffers"];
  if (!buffers.is_array()) buffers = json::array();
  if (has_chunk && !buffers.empty() && !buffers[0].contains("uri")) {
    binary_ = std::move(chunk);
    return;
  }
  buffers.insert(buffers.begin(), json{{"byteLength", 4}});
  if (document.contains("bufferViews"))
    for (json& view : document["bufferViews"]) {
      view["buffer"] = view["buffer"].get<std::size_t>() + 1;
      if (json* meshopt = const_cast<json*>(gltf::find_meshopt(view)))
        (*meshopt)["buffer"] = (*meshopt)["buffer"].get<std::size_t>() + 1;
    }
  binary_.resize(4);
}

std::size_t EditedAsset::add_view(std::span<const std::uint8_t> bytes) {
  binary_.resize((binary_.size() + 3) / 4 * 4);
  const std::size_t offset = binary_.size();
  binary_.insert(binary_.end(), bytes.begin(), bytes.end());
  document["buffers"][0]["byteLength"] = binary_.size();
  document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes.size()}});
  return document["bufferViews"].size() - 1;
}

template <class T>
std::size_t EditedAsset::add_accessor(const std::vector<T>& values, int component_type, const char* type) {
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(values.data()),
                                            values.size() * sizeof(T));
  const std::size_t view = add_view(bytes);
  document["accessors"].push_back(
      {{"bufferView", view}, {"componentType", component_type}, {"count", values.size()}, {"type", type}});
  return document["accessors"].size() - 1;
}

namespace {

// Four influences of each vertex, from number `first`.
std::pair<std::vector<std::array<std::uint16_t, 4>>, std::vector<Vec4>> influence_set(
    const std::vector<scene::SkinInfluence>& influences, std::size_t first) {
  std::pair<std::vector<std::array<std::uint16_t, 4>>, std::vector<Vec4>> out;
  for (const scene::SkinInfluence& influence : influences) {
    std::array<std::uint16_t, 4> joints{};
    Vec4 weights(0.0f);
    for (std::size_t k = 0; k < 4; ++k) {
      weights[static_cast<int>(k)] = influence.weights[first + k];
      if (influence.weights[first + k] > 0) joints[k] = influence.joints[first + k];
    }
    out.first.push_back(joints);
    out.second.push_back(weights);
  }
  return out;
}

bool any_beyond_four(const std::vector<scene::SkinInfluence>& influences) {
  return std::any_of(influences.begin(), influences.end(), [](const auto& i) {
    return std::any_of(i.weights.begin() + 4, i.weights.end(), [](float w) { return w > 0; });
  });
}

}  // namespace

std::size_t EditedAsset::add_positions(const std::vector<Vec3>& positions) {
  const std::size_t number = add_accessor(positions, gltf::kFloat, "VEC3");
  Vec3 low = positions.front(), high = low;
  for (const Vec3& p : positions) low = glm::min(low, p), high = glm::max(high, p);
  document["accessors"][number]["min"] = {low.x, low.y, low.z};
  document["accessors"][number]["max"] = {high.x, high.y, high.z};
  return number;
}

json EditedAsset::target_json(const scene::MorphTarget& target, std::size_t vertex_count) {
  json out = json::object();
  // A target that moves nothing still counts; glTF wants it to name something.
  out["POSITION"] =
      add_positions(target.positions.empty() ? std::vector<Vec3>(vertex_count, Vec3(0.0f)) : target.positions);
  if (!target.normals.empty()) out["NORMAL"] = add_accessor(target.normals, gltf::kFloat, "VEC3");
  if (!target.tangents.empty()) out["TANGENT"] = add_accessor(target.tangents, gltf::kFloat, "VEC3");
  return out;
}

void EditedAsset::write_primitive(json& json_primitive, const scene::Primitive& primitive,
                                  const std::vector<std::uint32_t>& indices) {
  const scene::Vertices& v = primitive.vertices;
  json attributes = json::object();
  attributes["POSITION"] = add_positions(v.positions);
  if (!v.normals.empty()) attributes["NORMAL"] = add_accessor(v.normals, gltf::kFloat, "VEC3");
  if (!v.tangents.empty()) attributes["TANGENT"] = add_accessor(v.tangents, gltf::kFloat, "VEC4");
  for (std::size_t set = 0; set < v.texcoords.size(); ++set)
    if (!v.texcoords[set].empty())
      attributes["TEXCOORD_" + std::to_string(set)] = add_accessor(v.texcoords[set], gltf::kFloat, "VEC2");
  if (!v.colors.empty()) attributes["COLOR_0"] = add_accessor(v.colors, gltf::kFloat, "VEC4");
  for (std::size_t set = 0; !v.influences.empty() && set < (any_beyond_four(v.influences) ? 2u : 1u); ++set) {
    const auto [joints, weights] = influence_set(v.influences, 4 * set);
    attributes["JOINTS_" + std::to_string(set)] = add_accessor(joints, gltf::kUnsignedShort, "VEC4");
    attributes["WEIGHTS_" + std::to_string(set)] = add_accessor(weights, gltf::kFloat, "VEC4");
  }
  json_primitive["attributes"] = std::move(attributes);
  json_primitive["indices"] = add_accessor(indices, gltf::kUnsignedInt, "SCALAR");
  json_primitive["mode"] = 4;
  if (json_primitive.contains("extensions")) json_primitive["extensions"].erase("TESSERA_clusters");
  if (json_primitive.contains("targets")) json_primitive["targets"] = json::array();
  for (const scene::MorphTarget& target : v.morph_targets)
    json_primitive["targets"].push_back(target_json(target, v.count()));
  if (json_primitive.contains("extensions")) json_primitive["extensions"].erase("KHR_draco_mesh_compression");
}

void EditedAsset::use_extension(const std::string& name) {
  json& names = document["extensionsUsed"];
  if (!names.is_array()) names = json::array();
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

void EditedAsset::drop_extension(const char* list, const std::string& name) {
  if (!document.contains(list)) return;
  json kept = json::array();
  for (const json& other : document[list])
    if (other != name) kept.push_back(other);
  if (kept.empty())
    document.erase(list);
  else
    document[list] = std::move(kept);
}

std::vector<std::uint32_t> cage_indices(std::size_t patches) {
  std::vector<std::uint32_t> indices;
  indices.reserve(patches * 54);
  for (std::size_t p = 0; p < patches; ++p)
    for (std::uint32_t j = 0; j < 3; ++j)
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t a = static_cast<std::uint32_t>(16 * p) + 4 * j + i;
        indices.insert(indices.end(), {a, a + 1, a + 5, a, a + 5, a + 4});
      }
  return indices;
}

}  // namespace tessera::replay
