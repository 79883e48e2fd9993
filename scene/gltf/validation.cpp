#include "scene/gltf/validation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "scene/extensions.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/meshopt_reader.h"
#include "scene/gltf/procedure_builder.h"
#include "scene/gltf/subdivision_builder.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// A top-level array of the document, or an empty one.
const json& array_of(const json& document, const char* name) {
  static const json kEmpty = json::array();
  const auto found = document.find(name);
  return found == document.end() ? kEmpty : *found;
}

const json* find(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

const json* extension(const json& object, const char* name) {
  const json* extensions = find(object, "extensions");
  return extensions == nullptr ? nullptr : find(*extensions, name);
}

// ---- Asset and extensions ---------------------------------------------------------------------------------------

void check_version(const json& d, const Place& root) {
  const json& asset = d["asset"];
  const auto& version = asset["version"].get_ref<const std::string&>();
  if (!version.starts_with("2."))
    root.at("asset").at("version").refuse("is {}, Tessera reads glTF 2", escape_control(version, 20));
  const std::string min_version = asset.value("minVersion", std::string("2.0"));
  if (min_version != "2.0")
    root.at("asset").at("minVersion").refuse("is {}, Tessera reads glTF 2.0", escape_control(min_version, 20));
}

void check_required_extensions(const json& d, const Place& root) {
  std::vector<std::string> missing;
  for (const json& name : array_of(d, "extensionsRequired")) {
    const auto& text = name.get_ref<const std::string&>();
    const auto& known = supported_extensions();
    if (std::none_of(known.begin(), known.end(), [&](const Extension& e) { return e.name == text; }))
      missing.push_back(escape_control(text, 60));
  }
  if (!missing.empty())
    root.at("extensionsRequired").refuse("needs what Tessera does not support: {}", fmt::join(missing, ", "));
}

// ---- Views and accessors ----------------------------------------------------------------------------------------

void check_buffer_views(const json& d, const Place& root) {
  const json& views = array_of(d, "bufferViews");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto offset = views[i].value("byteOffset", std::uint64_t{0}),
               length = views[i]["byteLength"].get<std::uint64_t>();
    const auto size = d["buffers"][views[i]["buffer"].get<std::size_t>()]["byteLength"].get<std::uint64_t>();
    if (offset > size || length > size - offset)
      root.at("bufferViews")
          .at(i)
          .refuse("bytes {} to {} lie outside its buffer of {} bytes", offset, offset + length, size);
    if (views[i].value("byteStride", 4) % 4 != 0)
      root.at("bufferViews").at(i).at("byteStride").refuse("is not a multiple of 4");
  }
}

// `count` elements of `bytes` bytes, `stride` apart from `offset`, lie inside the view.
void check_range(const json& d, std::size_t view, std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                 std::uint64_t bytes, std::uint64_t alignment, const Place& place) {
  const json& v = d["bufferViews"][view];
  const auto length = v["byteLength"].get<std::uint64_t>();
  if (stride < bytes) place.refuse("elements of {} bytes do not fit the view's stride of {}", bytes, stride);
  // count and stride are below 2^31 and 2^8: no overflow.
  const std::uint64_t needed = (count - 1) * stride + bytes;
  if (offset > length || needed > length - offset)
    place.refuse("needs bytes {} to {} of a view of {} bytes", offset, offset + needed, length);
  if ((offset + v.value("byteOffset", std::uint64_t{0})) % alignment != 0)
    place.refuse("does not start at a multiple of its component size, {}", alignment);
}

void check_accessors(const json& d, const Place& root) {
  const json& accessors = array_of(d, "accessors");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const Place place = root.at("accessors").at(i);
    const AccessorLayout layout = accessor_layout(d, i);
    const std::uint64_t size = component_bytes(layout.component_type);
    if (layout.normalized && (layout.component_type == kFloat || layout.component_type == kUnsignedInt))
      place.at("normalized").refuse("is true for a component type that cannot be");
    if (layout.has_view)
      check_range(d, accessors[i]["bufferView"].get<std::size_t>(), layout.byte_offset, layout.count, layout.stride,
                  layout.element_bytes, size, place);
    const json* sparse = find(accessors[i], "sparse");
    if (sparse == nullptr) continue;
    const Place inner = place.at("sparse");
    const auto count = (*sparse)["count"].get<std::uint64_t>();
    if (count > layout.count) inner.at("count").refuse("is {}, the accessor has {} elements", count, layout.count);
    const json &indices = (*sparse)["indices"], &values = (*sparse)["values"];
    const std::uint64_t index_size = component_bytes(indices["componentType"].get<int>());
    check_range(d, indices["bufferView"].get<std::size_t>(), indices.value("byteOffset", std::uint64_t{0}), count,
                index_size, index_size, index_size, inner.at("indices"));
    check_range(d, values["bufferView"].get<std::size_t>(), values.value("byteOffset", std::uint64_t{0}), count,
                layout.element_bytes, layout.element_bytes, size, inner.at("values"));
  }
}

// What an accessor must look like for a use: number of components and component types, "n" marking normalised ones.
struct Format {
  std::vector<int> components;
  std::vector<int> plain;       // component types allowed without normalisation
  std::vector<int> normalized;  // component types allowed with it
};

void check_format(const json& d, std::size_t accessor, const Format& format, const Place& place) {
  const AccessorLayout layout = accessor_layout(d, accessor);
  const auto contains = [](const std::vector<int>& list, int value) {
    return std::find(list.begin(), list.end(), value) != list.end();
  };
  if (!contains(format.components, layout.components) || (layout.columns > 1 && layout.components != 16))
    place.refuse("has accessor {} of type {}, which does not fit here", accessor,
                 d["accessors"][accessor]["type"].get_ref<const std::string&>());
  if (!contains(layout.normalized ? format.normalized : format.plain, layout.component_type))
    place.refuse("has accessor {} of component type {}{}, which does not fit here", accessor, layout.component_type,
                 layout.normalized ? " (normalized)" : "");
}

// ---- Images and textures ----------------------------------------------------------------------------------------

void check_images(const json& d, const Place& root) {
  const json& images = array_of(d, "images");
  for (std::size_t i = 0; i < images.size(); ++i)
    if (images[i].contains("uri") == images[i].contains("bufferView"))
      root.at("images").at(i).refuse("needs either a uri or a bufferView");
}

// ---- Nodes and scenes -------------------------------------------------------------------------------------------

void check_matrix(const json& matrix, const Place& place) {
  std::array<double, 16> m;
  for (std::size_t i = 0; i < 16; ++i) m[i] = matrix[i].get<double>();
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) place.refuse("has a last row that is not 0 0 0 1");
  // Columns of translation * rotation * scale are orthogonal.
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = a + 1; b < 3; ++b) {
      double product = 0, length_a = 0, length_b = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        product += m[4 * a + k] * m[4 * b + k];
        length_a += m[4 * a + k] * m[4 * a + k];
        length_b += m[4 * b + k] * m[4 * b + k];
      }
      if (std::abs(product) > 0.01 * std::sqrt(length_a * length_b))
        place.refuse("shears: it is not a translation, rotation and scale");
    }
}

void check_node(const json& d, std::size_t i, const Place& place) {
  const json& node = d["nodes"][i];
  if (const json* matrix = find(node, "matrix")) {
    for (const char* name : {"translation", "rotation", "scale"})
      if (node.contains(name)) place.refuse("has both a matrix and a {}", name);
    check_matrix(*matrix, place.at("matrix"));
  }
  if (const json* rotation = find(node, "rotation")) {
    double length2 = 0;
    for (const json& c : *rotation) length2 += c.get<double>() * c.get<double>();
    if (std::abs(length2 - 1.0) > 0.01)
      place.at("rotation").refuse("is not a unit quaternion: length {:g}", std::sqrt(length2));
  }
  if (node.contains("skin") && !node.contains("mesh")) place.at("skin").refuse("needs a mesh on the same node");
  if (const json* weights = find(node, "weights")) {
    if (!node.contains("mesh")) place.at("weights").refuse("need a mesh on the same node");
    const json& primitive = d["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
    const std::size_t targets = primitive.contains("targets") ? primitive["targets"].size() : 0;
    if (weights->size() != targets)
      place.at("weights").refuse("are {}, the mesh has {} morph targets", weights->size(), targets);
  }
}

// Attributes of instances other than these are the application's own; as many as the others all the same.
void check_instancing(const json& d, const json& node, const Place& place) {
  const json* instancing = extension(node, "EXT_mesh_gpu_instancing");
  if (instancing == nullptr) return;
  const Place inner = place.at("extensions").at("EXT_mesh_gpu_instancing");
  if (!node.contains("mesh")) inner.refuse("needs a mesh on the same node");
  std::optional<std::uint64_t> count;
  for (const auto& [name, index] : (*instancing)["attributes"].items()) {
    const Place at = inner.at("attributes").at(name);
    const auto accessor = index.get<std::size_t>();
    if (name == "ROTATION")
      check_format(d, accessor, {{4}, {kFloat}, {kByte, kShort}}, at);
    else if (name == "TRANSLATION" || name == "SCALE")
      check_format(d, accessor, {{3}, {kFloat}, {}}, at);
    const auto here = d["accessors"][accessor]["count"].get<std::uint64_t>();
    if (count && *count != here) at.refuse("has {} elements, other attributes have {}", here, *count);
    count = here;
  }
}

// Every node has at most one parent and no node is its own ancestor.
void check_node_graph(const json& d, const Place& root) {
  const json& nodes = array_of(d, "nodes");
  std::vector<std::optional<std::size_t>> parent(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Place place = root.at("nodes").at(i);
    check_node(d, i, place);
    check_instancing(d, nodes[i], place);
    if (const json* procedure = extension(nodes[i], "TESSERA_procedure"))
      check_procedure_links(d, *procedure, place.at("extensions").at("TESSERA_procedure"));
    const json* children = find(nodes[i], "children");
    for (std::size_t k = 0; children != nullptr && k < children->size(); ++k) {
      const auto child = (*children)[k].get<std::size_t>();
      if (parent[child])
        place.at("children").at(k).refuse("is node {}, which has a parent already: node {}", child, *parent[child]);
      parent[child] = i;
    }
  }
  // With one parent each, what cannot be reached from a parentless node hangs on a cycle.
  std::vector<std::uint8_t> state(nodes.size(), 0);  // 1: on the way up from here, 2: known to reach a root
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::vector<std::size_t> way;
    for (std::optional<std::size_t> n = i; n && state[*n] != 2; n = parent[*n]) {
      if (state[*n] == 1) root.at("nodes").at(*n).refuse("is its own ancestor");
      state[*n] = 1;
      way.push_back(*n);
    }
    for (const std::size_t n : way) state[n] = 2;
  }
  const json& scenes = array_of(d, "scenes");
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    const json* list = find(scenes[s], "nodes");
    std::set<std::size_t> seen;
    for (std::size_t k = 0; list != nullptr && k < list->size(); ++k) {
      const Place place = root.at("scenes").at(s).at("nodes").at(k);
      const auto node = (*list)[k].get<std::size_t>();
      if (parent[node]) place.refuse("is node {}, which is not a root", node);
      if (!seen.insert(node).second) place.refuse("lists node {} twice", node);
    }
  }
}

// ---- Meshes -----------------------------------------------------------------------------------------------------

bool uses_extension(const json& d, const char* name) {
  for (const json& used : array_of(d, "extensionsUsed"))
    if (used == name) return true;
  return false;
}

// Formats of glTF 2.0 section 3.7.2.1, with those that KHR_mesh_quantization adds.
std::optional<Format> attribute_format(std::string_view name, bool quantized) {
  const auto numbered = [&](std::string_view prefix) {
    return name.starts_with(prefix) && name.size() > prefix.size() &&
           std::all_of(name.begin() + static_cast<std::ptrdiff_t>(prefix.size()), name.end(),
                       [](char c) { return c >= '0' && c <= '9'; });
  };
  const std::vector<int> small = {kByte, kUnsignedByte, kShort, kUnsignedShort};
  if (name == "POSITION")
    return quantized ? Format{{3}, {kFloat, kByte, kUnsignedByte, kShort, kUnsignedShort}, small}
                     : Format{{3}, {kFloat}, {}};
  if (name == "NORMAL") return Format{{3}, {kFloat}, quantized ? std::vector<int>{kByte, kShort} : std::vector<int>{}};
  if (name == "TANGENT") return Format{{4}, {kFloat}, quantized ? std::vector<int>{kByte, kShort} : std::vector<int>{}};
  if (numbered("TEXCOORD_"))
    return quantized ? Format{{2}, {kFloat, kByte, kUnsignedByte, kShort, kUnsignedShort}, small}
                     : Format{{2}, {kFloat}, {kUnsignedByte, kUnsignedShort}};
  if (numbered("COLOR_")) return Format{{3, 4}, {kFloat}, {kUnsignedByte, kUnsignedShort}};
  if (numbered("JOINTS_")) return Format{{4}, {kUnsignedByte, kUnsignedShort}, {}};
  if (numbered("WEIGHTS_")) return Format{{4}, {kFloat}, {kUnsignedByte, kUnsignedShort}};
  return std::nullopt;
}

void check_attributes(const json& d, const json& attributes, bool targets, const Place& place) {
  const bool quantized = uses_extension(d, "KHR_mesh_quantization");
  std::optional<std::uint64_t> count;
  for (const auto& [name, index] : attributes.items()) {
    const auto accessor = index.get<std::size_t>();
    const std::optional<Format> format = attribute_format(name, quantized);
    if (!format) {
      if (!name.starts_with("_")) place.at(name).refuse("is not an attribute that glTF defines");
      continue;
    }
    Format wanted = *format;
    if (targets) {
      // A target's tangent has no handedness; differences of colours and coordinates may be signed.
      if (name == "TANGENT") wanted.components = {3};
      for (const int type : {kByte, kShort})
        if (name != "POSITION" && name != "NORMAL" && name != "TANGENT") wanted.normalized.push_back(type);
    }
    check_format(d, accessor, wanted, place.at(name));
    const std::uint64_t here = d["accessors"][accessor]["count"].get<std::uint64_t>();
    if (count && *count != here) place.at(name).refuse("has {} elements, other attributes have {}", here, *count);
    count = here;
  }
}

void check_numbered_sets(const json& attributes, const Place& place) {
  for (const char* prefix : {"TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"}) {
    std::size_t count = 0;
    for (const auto& [name, index] : attributes.items()) count += name.starts_with(prefix) ? 1 : 0;
    for (std::size_t i = 0; i < count; ++i)
      if (!attributes.contains(prefix + std::to_string(i)))
        place.refuse("has {} {} sets but no {}{}", count, prefix, prefix, i);
  }
  for (int i = 0; i < 2; ++i)
    if (attributes.contains("JOINTS_" + std::to_string(i)) != attributes.contains("WEIGHTS_" + std::to_string(i)))
      place.refuse("needs JOINTS_{} and WEIGHTS_{} together", i, i);
}

void check_draco(const json& primitive, const json& draco, const Place& place) {
  const int mode = primitive.value("mode", 4);
  if (mode != 4 && mode != 5) place.at("mode").refuse("is {}, KHR_draco_mesh_compression holds triangles", mode);
  if (!primitive.contains("indices")) place.refuse("uses KHR_draco_mesh_compression without indices");
  std::set<std::uint64_t> ids;
  const Place inner = place.at("extensions").at("KHR_draco_mesh_compression").at("attributes");
  for (const auto& [name, id] : draco["attributes"].items()) {
    if (!primitive["attributes"].contains(name)) inner.at(name).refuse("is not an attribute of the primitive");
    if (!ids.insert(id.get<std::uint64_t>()).second)
      inner.at(name).refuse("shares its id {} with another attribute", id.dump());
  }
}

void check_primitive(const json& d, const json& primitive, const Place& place) {
  const json& attributes = primitive["attributes"];
  check_attributes(d, attributes, false, place.at("attributes"));
  check_numbered_sets(attributes, place.at("attributes"));
  const json* draco = extension(primitive, "KHR_draco_mesh_compression");
  if (draco != nullptr) check_draco(primitive, *draco, place);
  for (const auto& [name, index] : attributes.items()) {
    const json& accessor = d["accessors"][index.get<std::size_t>()];
    const bool inside_draco = draco != nullptr && (*draco)["attributes"].contains(name);
    if (name == "POSITION" && !inside_draco && !accessor.contains("bufferView") && !accessor.contains("sparse"))
      place.at("attributes").at(name).refuse("has an accessor without data");
  }
  if (const json* indices = find(primitive, "indices")) {
    const auto accessor = indices->get<std::size_t>();
    check_format(d, accessor, {{1}, {kUnsignedByte, kUnsignedShort, kUnsignedInt}, {}}, place.at("indices"));
    // Viewers differ in whether they honour it.
    if (const json* view = find(d["accessors"][accessor], "bufferView"))
      if (d["bufferViews"][view->get<std::size_t>()].contains("byteStride"))
        place.at("indices").refuse("has a view with a byteStride");
  }
  const json* targets = find(primitive, "targets");
  for (std::size_t t = 0; targets != nullptr && t < targets->size(); ++t) {
    const Place inner = place.at("targets").at(t);
    check_attributes(d, (*targets)[t], true, inner);
    for (const auto& [name, index] : (*targets)[t].items()) {
      if (!attributes.contains(name)) {
        if (!name.starts_with("_")) inner.at(name).refuse("moves an attribute that the primitive does not have");
        continue;
      }
      const auto count = d["accessors"][index.get<std::size_t>()]["count"].get<std::uint64_t>();
      const auto base = d["accessors"][attributes[name].get<std::size_t>()]["count"].get<std::uint64_t>();
      if (count != base) inner.at(name).refuse("has {} elements, the attribute has {}", count, base);
    }
  }
  if (const json* bezier = extension(primitive, "TESSERA_bezier_patches")) {
    const Place inner = place.at("extensions").at("TESSERA_bezier_patches");
    if (primitive.value("mode", 4) != 4) inner.refuse("needs a control cage of triangles (mode 4)");
    if (!attributes.contains("POSITION")) inner.refuse("needs POSITION");
    const auto vertices = d["accessors"][attributes["POSITION"].get<std::size_t>()]["count"].get<std::uint64_t>();
    const auto count = (*bezier)["count"].get<std::uint64_t>();
    if (vertices != 16 * count)
      inner.at("count").refuse("is {} patches of 16 control points, POSITION has {}", count, vertices);
  }
  check_subdivision(d, primitive, place);
}

void check_material_texcoords(const json& d, const json& primitive, const Place& place) {
  const json* index = find(primitive, "material");
  if (index == nullptr) return;
  const json& material = d["materials"][index->get<std::size_t>()];
  const auto check = [&](const json* info) {
    if (info == nullptr) return;
    const json* transform = extension(*info, "KHR_texture_transform");
    int set = info->value("texCoord", 0);
    if (transform != nullptr) set = transform->value("texCoord", set);
    if (!primitive["attributes"].contains("TEXCOORD_" + std::to_string(set)))
      place.refuse("lacks TEXCOORD_{}, which its material {} reads", set, index->get<std::size_t>());
  };
  if (const json* pbr = find(material, "pbrMetallicRoughness"))
    for (const char* name : {"baseColorTexture", "metallicRoughnessTexture"}) check(find(*pbr, name));
  for (const char* name : {"normalTexture", "occlusionTexture", "emissiveTexture"}) check(find(material, name));
  if (const json* displacement = extension(material, "TESSERA_displacement")) check(&(*displacement)["texture"]);
}

void check_meshes(const json& d, const Place& root) {
  const json& meshes = array_of(d, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Place place = root.at("meshes").at(m);
    const json& primitives = meshes[m]["primitives"];
    const auto target_count = [](const json& primitive) {
      return primitive.contains("targets") ? primitive["targets"].size() : std::size_t{0};
    };
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Place inner = place.at("primitives").at(p);
      check_primitive(d, primitives[p], inner);
      check_material_texcoords(d, primitives[p], inner.at("attributes"));
      if (target_count(primitives[p]) != target_count(primitives[0]))
        inner.at("targets").refuse("are {}, the first primitive has {}", target_count(primitives[p]),
                                   target_count(primitives[0]));
    }
    if (const json* weights = find(meshes[m], "weights"))
      if (weights->size() != target_count(primitives[0]))
        place.at("weights").refuse("are {}, the primitives have {} morph targets", weights->size(),
                                   target_count(primitives[0]));
  }
}

// ---- Skins, animations ------------------------------------------------------------------------------------------

void check_skins(const json& d, const Place& root) {
  const json& skins = array_of(d, "skins");
  for (std::size_t s = 0; s < skins.size(); ++s) {
    const Place place = root.at("skins").at(s);
    std::set<std::size_t> seen;
    const json& joints = skins[s]["joints"];
    for (std::size_t k = 0; k < joints.size(); ++k)
      if (!seen.insert(joints[k].get<std::size_t>()).second) place.at("joints").at(k).refuse("names a joint twice");
    if (const json* matrices = find(skins[s], "inverseBindMatrices")) {
      const auto accessor = matrices->get<std::size_t>();
      check_format(d, accessor, {{16}, {kFloat}, {}}, place.at("inverseBindMatrices"));
      const auto count = d["accessors"][accessor]["count"].get<std::uint64_t>();
      if (count < joints.size())
        place.at("inverseBindMatrices").refuse("are {}, there are {} joints", count, joints.size());
    }
  }
  // A skinned mesh ignores its node's transform; viewers disagree about one without joints.
  const json& nodes = array_of(d, "nodes");
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (!nodes[n].contains("skin")) continue;
    for (const json& primitive : d["meshes"][nodes[n]["mesh"].get<std::size_t>()]["primitives"])
      if (!primitive["attributes"].contains("JOINTS_0"))
        root.at("nodes").at(n).at("skin").refuse("needs a mesh with JOINTS_0 and WEIGHTS_0");
  }
}

void check_animation_channel(const json& d, const json& animation, std::size_t c, const Place& place) {
  const json& channel = animation["channels"][c];
  const auto sampler_index = channel["sampler"].get<std::size_t>();
  if (sampler_index >= animation["samplers"].size())
    place.at("sampler").refuse("points at sampler {}, there are {}", sampler_index, animation["samplers"].size());
  const json& sampler = animation["samplers"][sampler_index];
  const auto input = sampler["input"].get<std::size_t>(), output = sampler["output"].get<std::size_t>();
  check_format(d, input, {{1}, {kFloat}, {}}, place);

  const auto& path = channel["target"]["path"].get_ref<const std::string&>();
  const bool integers_allowed = path == "rotation" || path == "weights";
  const std::vector<int> normalized =
      integers_allowed ? std::vector<int>{kByte, kUnsignedByte, kShort, kUnsignedShort} : std::vector<int>{};
  const int components = path == "rotation" ? 4 : path == "weights" ? 1 : 3;
  check_format(d, output, {{components}, {kFloat}, normalized}, place);

  const bool cubic = sampler.value("interpolation", std::string("LINEAR")) == "CUBICSPLINE";
  const auto keys = d["accessors"][input]["count"].get<std::uint64_t>();
  const auto values = d["accessors"][output]["count"].get<std::uint64_t>();
  std::uint64_t per_key = cubic ? 3 : 1;
  const json* node_index = find(channel["target"], "node");
  if (node_index != nullptr) {
    const json& node = d["nodes"][node_index->get<std::size_t>()];
    if (path == "weights") {
      if (!node.contains("mesh")) place.at("target").refuse("animates weights of a node without a mesh");
      const json& primitive = d["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
      const std::size_t targets = primitive.contains("targets") ? primitive["targets"].size() : 0;
      if (targets == 0) place.at("target").refuse("animates weights of a mesh without morph targets");
      per_key *= targets;
    } else if (node.contains("matrix")) {
      place.at("target").refuse("animates a node that has a matrix");
    }
  } else if (path == "weights") {
    return;  // no node: the channel is to be ignored, and its value count cannot be known
  }
  if (values != keys * per_key)
    place.refuse("has {} output values for {} keys, needs {}", values, keys, keys * per_key);
}

void check_animations(const json& d, const Place& root) {
  const json& animations = array_of(d, "animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const Place place = root.at("animations").at(a);
    std::set<std::pair<std::size_t, std::string>> targets;
    const json& channels = animations[a]["channels"];
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Place inner = place.at("channels").at(c);
      check_animation_channel(d, animations[a], c, inner);
      const json& target = channels[c]["target"];
      if (target.contains("node") &&
          !targets.emplace(target["node"].get<std::size_t>(), target["path"].get<std::string>()).second)
        inner.at("target").refuse("is animated twice in one animation");
    }
  }
}

// ---- Cameras, lights, Tessera's own settings --------------------------------------------------------------------

void check_cameras(const json& d, const Place& root) {
  const json& cameras = array_of(d, "cameras");
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Place place = root.at("cameras").at(c);
    const auto& type = cameras[c]["type"].get_ref<const std::string&>();
    const json* projection = find(cameras[c], type.c_str());
    if (projection == nullptr) place.refuse("says {} but has no such property", type);
    const Place inner = place.at(type);
    const float near = (*projection)["znear"].get<float>();
    if (const json* far = find(*projection, "zfar"))
      if (!(far->get<float>() > near)) inner.at("zfar").refuse("is not greater than znear");
    for (const char* name : {"xmag", "ymag"})
      if (const json* mag = find(*projection, name); mag != nullptr && mag->get<float>() == 0)
        inner.at(name).refuse("is zero");
  }
}

void check_lights(const json& d, const Place& root) {
  const json* extension_json = extension(d, "KHR_lights_punctual");
  if (extension_json == nullptr) return;
  const json& lights = (*extension_json)["lights"];
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const Place place = root.at("extensions").at("KHR_lights_punctual").at("lights").at(l);
    if (lights[l]["type"] != "spot") continue;
    const json* spot = find(lights[l], "spot");
    if (spot == nullptr) place.refuse("is a spot light without a spot property");
    if (!(spot->value("innerConeAngle", 0.0) < spot->value("outerConeAngle", 0.7853981633974483)))
      place.at("spot").refuse("has an inner cone that is not smaller than the outer one");
  }
}

void check_capture_settings(const json& d, const Place& root) {
  const json* settings = extension(d, "TESSERA_capture");
  if (settings == nullptr) return;
  const Place place = root.at("extensions").at("TESSERA_capture");
  if (const json* shutter = find(*settings, "shutter"))
    if ((*shutter)[0].get<double>() > (*shutter)[1].get<double>()) place.at("shutter").refuse("closes before it opens");
  if (const json* camera = find(*settings, "camera"))
    if (!d["nodes"][camera->get<std::size_t>()].contains("camera"))
      place.at("camera").refuse("is a node without a camera");
}

}  // namespace

void validate_links(const json& d, const Place& root) {
  check_version(d, root);
  check_required_extensions(d, root);
  check_buffer_views(d, root);
  check_meshopt(d, root);
  check_accessors(d, root);
  check_images(d, root);
  check_node_graph(d, root);
  check_meshes(d, root);
  check_skins(d, root);
  check_animations(d, root);
  check_cameras(d, root);
  check_lights(d, root);
  check_capture_settings(d, root);
}

}  // namespace tessera::scene::gltf
