#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/validation.h"

namespace tessera::scene::gltf::validation {
namespace {

using nlohmann::json;

bool uses_extension(const json& d, const char* name) {
  for (const json& used : list_of(d, "extensionsUsed"))
    if (used == name) return true;
  return false;
}

// Formats of glTF 2.0 section 3.7.2.1, with the additions of KHR_mesh_quantization if `quantized`.
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

bool has_format(const json& d, std::size_t accessor, const Format& format) {
  const AccessorLayout layout = accessor_layout(d, accessor);
  const auto contains = [](const std::vector<int>& list, int value) {
    return std::find(list.begin(), list.end(), value) != list.end();
  };
  return layout.columns == 1 && contains(format.components, layout.components) &&
         contains(layout.normalized ? format.normalized : format.plain, layout.component_type);
}

void check_attributes(const json& d, const json& attributes, bool targets, const Place& place, Notes& notes) {
  const bool declared = uses_extension(d, "KHR_mesh_quantization");
  std::optional<std::uint64_t> count;
  for (const auto& [name, index] : attributes.items()) {
    const auto accessor = index.get<std::size_t>();
    const std::optional<Format> format = attribute_format(name, declared);
    if (!format) {
      if (!name.starts_with("_"))
        notes.violation(place.at(name), "such attributes are ignored", "is not an attribute that glTF defines");
      continue;
    }
    const auto of_target = [&, &attribute = name](Format wanted) {
      if (!targets) return wanted;
      // A target's tangent has no handedness; differences of colours and coordinates may be signed.
      if (attribute == "TANGENT") wanted.components = {3};
      for (const int type : {kByte, kShort})
        if (attribute != "POSITION" && attribute != "NORMAL" && attribute != "TANGENT")
          wanted.normalized.push_back(type);
      return wanted;
    };
    const Format wanted = of_target(*format);
    if (!declared && !has_format(d, accessor, wanted) &&
        has_format(d, accessor, of_target(*attribute_format(name, true))))
      notes.violation(place.at(name), "it is read as KHR_mesh_quantization says",
                      "has accessor {}, whose integers KHR_mesh_quantization allows, which is not declared", accessor);
    else
      check_format(d, accessor, wanted, place.at(name));
    const std::uint64_t here = d["accessors"][accessor]["count"].get<std::uint64_t>();
    if (count && *count != here) place.at(name).refuse("has {} elements, other attributes have {}", here, *count);
    count = here;
  }
}

void check_numbered_sets(const json& attributes, const Place& place, Notes& notes) {
  // A gap among coordinates and colours moves nothing, one among joints would leave vertices without.
  for (const char* prefix : {"TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"}) {
    std::size_t count = 0;
    for (const auto& [name, index] : attributes.items()) count += name.starts_with(prefix) ? 1 : 0;
    for (std::size_t i = 0; i < count; ++i)
      if (!attributes.contains(prefix + std::to_string(i))) {
        const std::string fault = fmt::format("has {} {} sets but no {}{}", count, prefix, prefix, i);
        if (prefix[0] == 'J' || prefix[0] == 'W') place.refuse("{}", fault);
        notes.violation(place, "sets keep their numbers", "{}", fault);
      }
  }
  for (std::size_t i = 0; i < attributes.size(); ++i)
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

void check_clusters(const json& d, const json& primitive, const json& clusters, const Place& place, Notes& notes) {
  const Place inner = place.at("extensions").at("TESSERA_clusters");
  for (const char* member : {"bits", "clusters", "bufferView"})
    if (!clusters.contains(member)) inner.refuse("has an encoding without {}", member);
  if (primitive.value("mode", 4) != 4)
    place.at("mode").refuse("is {}, clusters are triangles", primitive["mode"].dump());
  if (!primitive.contains("indices") || !primitive["attributes"].contains("POSITION"))
    place.refuse("encodes clusters without POSITION and indices");
  for (const char* other : {"KHR_draco_mesh_compression", "TESSERA_bezier_patches", "TESSERA_subdivision"})
    if (find_extension(primitive, other) != nullptr) inner.refuse("encodes data that {} has as well", other);
  const AccessorLayout positions = accessor_layout(d, primitive["attributes"]["POSITION"].get<std::size_t>()),
                       indices = accessor_layout(d, primitive["indices"].get<std::size_t>());
  if (positions.component_type != kFloat) inner.refuse("encodes positions that are no floats");
  const json& required = list_of(d, "extensionsRequired");
  if (std::find(required.begin(), required.end(), "TESSERA_clusters") == required.end())
    notes.violation(inner, "positions are decoded",
                    "encodes data that other readers take for zeros: extensionsRequired lacks it");
  if (indices.count % 3 != 0) place.at("indices").refuse("are {}, three for each triangle of clusters", indices.count);
}

void check_indices(const json& d, const json& primitive, const Place& place, Notes& notes) {
  const json* indices = find(primitive, "indices");
  if (indices == nullptr) return;
  const auto accessor = indices->get<std::size_t>();
  const AccessorLayout layout = accessor_layout(d, accessor);
  if (layout.normalized && layout.components == 1)
    notes.violation(place, "indices are whole numbers",
                    "has accessor {} of component type {} (normalized), which does not fit here", accessor,
                    layout.component_type);
  const std::vector<int> types = {kUnsignedByte, kUnsignedShort, kUnsignedInt};
  check_format(d, accessor, {{1}, types, types}, place);
  // Viewers differ in whether they honour it, where it makes a difference.
  const json* view = find(d["accessors"][accessor], "bufferView");
  if (view == nullptr || !d["bufferViews"][view->get<std::size_t>()].contains("byteStride")) return;
  if (layout.stride != layout.element_bytes) place.refuse("has a view with a byteStride");
  notes.violation(place, "which equals the size of its elements", "has a view with a byteStride");
}

void check_target(const json& d, const json& attributes, const json& target, const Place& place, Notes& notes) {
  check_attributes(d, target, true, place, notes);
  for (const auto& [name, index] : target.items()) {
    if (!attributes.contains(name)) {
      if (!name.starts_with("_"))
        notes.violation(place.at(name), "it moves nothing", "moves an attribute that the primitive does not have");
      continue;
    }
    const auto count = d["accessors"][index.get<std::size_t>()]["count"].get<std::uint64_t>();
    const auto base = d["accessors"][attributes[name].get<std::size_t>()]["count"].get<std::uint64_t>();
    if (count != base) place.at(name).refuse("has {} elements, the attribute has {}", count, base);
  }
}

void check_primitive(const json& d, const json& primitive, const Place& place, Notes& notes) {
  const json& attributes = primitive["attributes"];
  check_attributes(d, attributes, false, place.at("attributes"), notes);
  check_numbered_sets(attributes, place.at("attributes"), notes);
  const json* draco = find_extension(primitive, "KHR_draco_mesh_compression");
  if (draco != nullptr) check_draco(primitive, *draco, place);
  const json* clusters = find_encoded_clusters(primitive);
  if (clusters != nullptr) check_clusters(d, primitive, *clusters, place, notes);
  for (const auto& [name, index] : attributes.items()) {
    const json& accessor = d["accessors"][index.get<std::size_t>()];
    const bool inside_stream = clusters != nullptr || (draco != nullptr && (*draco)["attributes"].contains(name));
    if (name == "POSITION" && !inside_stream && !accessor.contains("bufferView") && !accessor.contains("sparse"))
      notes.add(place.at("attributes").at(name), "all of its positions are zero", "has an accessor without data");
  }
  check_indices(d, primitive, place.at("indices"), notes);
  if (const json* targets = find(primitive, "targets"))
    for (std::size_t t = 0; t < targets->size(); ++t)
      check_target(d, attributes, (*targets)[t], place.at("targets").at(t), notes);
  if (const json* bezier = find_extension(primitive, "TESSERA_bezier_patches")) {
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

void check_material_texcoords(const json& d, const json& primitive, const Place& place, Notes& notes) {
  const json* index = find(primitive, "material");
  if (index == nullptr) return;
  const json& material = d["materials"][index->get<std::size_t>()];
  const auto check = [&](const json* info) {
    if (info == nullptr) return;
    const json* transform = find_extension(*info, "KHR_texture_transform");
    int set = info->value("texCoord", 0);
    if (transform != nullptr) set = transform->value("texCoord", set);
    if (!primitive["attributes"].contains("TEXCOORD_" + std::to_string(set)))
      notes.violation(place, "it is drawn without these textures", "lacks TEXCOORD_{}, which its material {} reads",
                      set, index->get<std::size_t>());
  };
  for (const MaterialTextureRow& row : material_textures())
    if (const json* owner = find_at(material, row.object)) check(find(*owner, row.name));
  if (const json* displacement = find_extension(material, "TESSERA_displacement")) check(&(*displacement)["texture"]);
}

}  // namespace

void check_meshes(const json& d, const Place& root, Notes& notes) {
  const json& meshes = list_of(d, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Place place = root.at("meshes").at(m);
    const json& primitives = meshes[m]["primitives"];
    const auto targets_of = [](const json& primitive) {
      return primitive.contains("targets") ? primitive["targets"].size() : std::size_t{0};
    };
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Place inner = place.at("primitives").at(p);
      check_primitive(d, primitives[p], inner, notes);
      check_material_texcoords(d, primitives[p], inner.at("attributes"), notes);
      if (targets_of(primitives[p]) != targets_of(primitives[0]))
        notes.violation(inner.at("targets"), "each primitive has its own", "are {}, the first primitive has {}",
                        targets_of(primitives[p]), targets_of(primitives[0]));
    }
    if (const json* weights = find(meshes[m], "weights"))
      if (weights->size() != target_count(meshes[m]))
        notes.violation(place.at("weights"), "the others are zero or ignored",
                        "are {}, the primitives have {} morph targets", weights->size(), target_count(meshes[m]));
  }
}

}  // namespace tessera::scene::gltf::validation
