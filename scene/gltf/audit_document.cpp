#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "scene/extensions.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/accessor_uses.h"
#include "scene/gltf/audit.h"
#include "scene/gltf/meshopt_reader.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// ---- Values anywhere --------------------------------------------------------------------------------------------

bool names_what(std::string_view key) {
  static const std::set<std::string_view> kTexts = {"name", "generator", "copyright", "mimeType"};
  return kTexts.contains(key);
}

// Where an extension may stand: the names of the document's lists.
const std::map<std::string_view, std::set<std::string_view>>& homes() {
  static const std::map<std::string_view, std::set<std::string_view>> kHomes = [] {
    std::map<std::string_view, std::set<std::string_view>> out = {{"KHR_lights_punctual", {"", "nodes"}},
                                                                  {"KHR_texture_transform", {"textureInfo"}},
                                                                  {"KHR_mesh_quantization", {}},
                                                                  {"EXT_texture_webp", {"textures"}},
                                                                  {"KHR_texture_basisu", {"textures"}},
                                                                  {"KHR_node_visibility", {"nodes"}},
                                                                  {"KHR_materials_variants", {"", "primitives"}},
                                                                  {"KHR_animation_pointer", {"target"}}};
    for (const Extension& extension : supported_extensions())
      if (extension.extends == "material" && extension.name.starts_with("KHR_")) out[extension.name] = {"materials"};
    return out;
  }();
  return kHomes;
}

struct Anywhere {
  const std::set<std::string>& used;
  Notes& notes;

  // `home`: the list whose element `value` is, or the member that it is.
  void look(const json& value, const std::string& home, const Place& place) const {
    if (value.is_array()) {
      if (value.empty()) forbid(notes, place, "EMPTY_ENTITY", "is empty");
      for (std::size_t i = 0; i < value.size(); ++i) look(value[i], home, place.at(i));
      return;
    }
    if (!value.is_object()) return;
    for (const auto& [key, inner] : value.items()) {
      if (key == "extras") continue;
      if (key == "extensions") {
        look_at_extensions(inner, home, place.at(key));
        continue;
      }
      if (names_what(key) && !inner.is_string() && home != "attributes")
        forbid(notes, place.at(key), "TYPE_MISMATCH", "is not a text");
      if ((key == "attributes") && inner.is_object() && inner.empty())
        forbid(notes, place.at(key), "EMPTY_ENTITY", "is empty");
      look(inner, key.ends_with("Texture") || key == "texture" ? "textureInfo" : key, place.at(key));
    }
  }

 private:
  void look_at_extensions(const json& extensions, const std::string& home, const Place& place) const {
    if (!extensions.is_object()) return forbid(notes, place, "TYPE_MISMATCH", "is not an object");
    for (const auto& [name, object] : extensions.items()) {
      if (!used.contains(name))
        forbid(notes, place.at(name), "UNDECLARED_EXTENSION", "is not declared in extensionsUsed");
      if (const auto known = homes().find(name); known != homes().end() && !known->second.contains(home))
        forbid(notes, place.at(name), "UNEXPECTED_EXTENSION_OBJECT", "is an extension that has no place here");
      if (!object.is_object()) forbid(notes, place.at(name), "TYPE_MISMATCH", "is not an object");
      if (name.starts_with("KHR_") || name.starts_with("EXT_texture")) look(object, name, place.at(name));
    }
  }
};

// ---- Asset, extensions ------------------------------------------------------------------------------------------

bool is_version(const json& text) {
  const std::string s = text.is_string() ? text.get<std::string>() : "";
  const std::size_t dot = s.find('.');
  const auto digits = [](std::string_view part) {
    return !part.empty() && std::all_of(part.begin(), part.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  return dot != std::string::npos && digits(std::string_view(s).substr(0, dot)) &&
         digits(std::string_view(s).substr(dot + 1));
}

void audit_asset(const json& d, const Place& root, Notes& notes) {
  for (const char* name : {"version", "minVersion"})
    if (const json* version = find(d["asset"], name); version != nullptr && !is_version(*version))
      forbid(notes, root.at("asset").at(name), "PATTERN_MISMATCH", "is no version like 2.0");
}

std::set<std::string> names_of(const json& d, const char* list) {
  std::set<std::string> names;
  for (const json& name : list_of(d, list)) names.insert(name.get<std::string>());
  return names;
}

void audit_extension_lists(const json& d, const std::set<std::string>& used, const Place& root, Notes& notes) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"})
    if (names_of(d, list).size() != list_of(d, list).size())
      forbid(notes, root.at(list), "DUPLICATE_ELEMENTS", "names an extension twice");
  const std::set<std::string> required = names_of(d, "extensionsRequired");
  for (const std::string& name : required)
    if (!used.contains(name))
      forbid(notes, root.at("extensionsRequired"), "UNUSED_EXTENSION_REQUIRED", "has {}, which extensionsUsed lacks",
             escape_control(name, 60));
  if (!required.empty() && !d.contains("extensionsUsed"))
    forbid(notes, root, "UNSATISFIED_DEPENDENCY", "has extensionsRequired without extensionsUsed");
  if (used.contains("KHR_mesh_quantization") && !required.contains("KHR_mesh_quantization"))
    forbid(notes, root, "NON_REQUIRED_EXTENSION", "uses KHR_mesh_quantization without requiring it");
}

// ---- Buffers, views, accessors ----------------------------------------------------------------------------------

void audit_bounds(const json& accessor, const AccessorLayout& layout, const Place& place, Notes& notes) {
  for (const char* name : {"min", "max"}) {
    const json* bound = find(accessor, name);
    if (bound == nullptr) continue;
    if (!bound->is_array()) {
      forbid(notes, place.at(name), "TYPE_MISMATCH", "is not an array");
      continue;
    }
    if (bound->size() != static_cast<std::size_t>(layout.components))
      forbid(notes, place.at(name), "ARRAY_LENGTH_NOT_IN_LIST", "has {} elements, needs {}", bound->size(),
             layout.components);
    for (std::size_t i = 0; i < bound->size(); ++i)
      if (!(*bound)[i].is_number()) forbid(notes, place.at(name).at(i), "ARRAY_TYPE_MISMATCH", "is not a number");
  }
}

void audit_accessors(const json& d, const Place& root, Notes& notes) {
  const json& accessors = list_of(d, "accessors");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const Place place = root.at("accessors").at(i);
    const AccessorLayout layout = accessor_layout(d, i);
    audit_bounds(accessors[i], layout, place, notes);
    if (!layout.has_view && accessors[i].contains("byteOffset"))
      forbid(notes, place.at("byteOffset"), "UNSATISFIED_DEPENDENCY", "stands without a bufferView");
    if (layout.columns > 1 && layout.byte_offset % 4 != 0)
      forbid(notes, place.at("byteOffset"), "ACCESSOR_MATRIX_ALIGNMENT", "is not a multiple of 4, as matrices need");
    if (layout.byte_offset % component_bytes(layout.component_type) != 0)
      forbid(notes, place.at("byteOffset"), "ACCESSOR_OFFSET_ALIGNMENT", "is not a multiple of its component size, {}",
             component_bytes(layout.component_type));
  }
}

void audit_views(const json& d, const Place& root, Notes& notes) {
  const json &views = list_of(d, "bufferViews"), &buffers = list_of(d, "buffers");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Place place = root.at("bufferViews").at(i);
    const json *stride = find(views[i], "byteStride"), *target = find(views[i], "target");
    if (stride == nullptr) continue;
    if (find_meshopt(views[i]) == nullptr && stride->get<double>() > views[i]["byteLength"].get<double>())
      forbid(notes, place.at("byteStride"), "BUFFER_VIEW_TOO_BIG_BYTE_STRIDE", "is more than the view's byteLength");
    if (target != nullptr && *target == 34963)
      forbid(notes, place.at("byteStride"), "BUFFER_VIEW_INVALID_BYTE_STRIDE", "belongs to vertices, not to indices");
  }
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const json* uri = find(buffers[i], "uri");
    if (uri == nullptr) continue;
    const auto& text = uri->get_ref<const std::string&>();
    if (!is_data_uri(text)) continue;
    const std::string type = text.substr(5, text.find_first_of(";,") - 5);
    if (type != "application/octet-stream" && type != "application/gltf-buffer")
      forbid(notes, root.at("buffers").at(i).at("uri"), "BUFFER_DATA_URI_MIME_TYPE_INVALID",
             "is a data URI of type '{}'", escape_control(type, 40));
  }
}

// ---- Uses of accessors ------------------------------------------------------------------------------------------

// The kind of a use; all uses of an accessor, and all of a view, must be of one kind.
const char* kind_of(const AccessorUsed& use) {
  switch (use.role) {
    case AccessorRole::kIndices:
      return "indices";
    case AccessorRole::kVertices:
    case AccessorRole::kTarget:
      return "vertices";
    case AccessorRole::kKeyTimes:
      return "key times";
    case AccessorRole::kKeyValues:
      return "key values";
    case AccessorRole::kInverseBind:
      return "inverse bind matrices";
    case AccessorRole::kInstances:
      break;
  }
  return "instances";
}

struct ViewUse {
  std::string kind;
  std::set<std::size_t> vertex_accessors;
};

class UseAudit {
 public:
  UseAudit(const json& d, Notes& notes) : d_(d), notes_(notes) {}

  void add(const AccessorUsed& use, const Place& place) {
    const json& accessor = d_["accessors"][use.accessor];
    const AccessorLayout layout = accessor_layout(d_, use.accessor);
    const std::string kind = kind_of(use);
    const bool of_vertices = kind == std::string("vertices");
    if (const auto [at, fresh] = kinds_.try_emplace(use.accessor, kind); !fresh && at->second != kind)
      forbid(notes_, place, "ACCESSOR_USAGE_OVERRIDE", "has accessor {}, which holds {} elsewhere and {} here",
             use.accessor, at->second, kind);
    const bool bounded = accessor.contains("min") && accessor.contains("max");
    if ((use.name == "POSITION" && use.role != AccessorRole::kInstances) && !bounded)
      forbid(notes_, place, "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS", "has an accessor without min and max");
    if (use.role == AccessorRole::kKeyTimes && !bounded)
      forbid(notes_, place, "ANIMATION_SAMPLER_INPUT_ACCESSOR_WITHOUT_BOUNDS", "has an accessor without min and max");
    if (of_vertices && layout.component_type == kUnsignedInt)
      forbid(notes_, place, "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT", "has an accessor of unsigned integers");
    if (!layout.has_view) return;
    const auto view = accessor["bufferView"].get<std::size_t>();
    const json& v = d_["bufferViews"][view];
    if (of_vertices && (layout.byte_offset % 4 != 0 || layout.stride % 4 != 0 ||
                        (layout.byte_offset + v.value("byteOffset", std::uint64_t{0})) % 4 != 0))
      forbid(notes_, place, "MESH_PRIMITIVE_ACCESSOR_UNALIGNED", "has data that do not lie at multiples of 4 bytes");
    if (v.contains("byteStride")) add_strided(use, place);
    add_view(view, of_vertices ? "vertices" : kind == "indices" ? "indices" : "", use, place);
  }

 private:
  void add_strided(const AccessorUsed& use, const Place& place) {
    const char* code = use.role == AccessorRole::kKeyTimes || use.role == AccessorRole::kKeyValues
                           ? "ANIMATION_SAMPLER_ACCESSOR_WITH_BYTESTRIDE"
                       : use.role == AccessorRole::kInverseBind ? "SKIN_IBM_ACCESSOR_WITH_BYTESTRIDE"
                                                                : nullptr;
    if (code != nullptr) forbid(notes_, place, code, "has a view with a byteStride");
  }

  void add_view(std::size_t view, const std::string& kind, const AccessorUsed& use, const Place& place) {
    ViewUse& known = views_[view];
    const json& v = d_["bufferViews"][view];
    if (const json* target = find(v, "target");
        target != nullptr && known.kind.empty() && (*target == 34962 || *target == 34963))
      known.kind = *target == 34962 ? "vertices" : "indices";
    const std::string here = kind.empty() ? "other data" : kind;
    if (known.kind.empty()) known.kind = here;
    if (known.kind != here)
      forbid(notes_, place, "BUFFER_VIEW_TARGET_OVERRIDE", "has a view that holds {} elsewhere and {} here", known.kind,
             here);
    if (here != "vertices" || v.contains("byteStride") || find_meshopt(v) != nullptr) return;
    known.vertex_accessors.insert(use.accessor);
    if (known.vertex_accessors.size() == 2)
      forbid(notes_, place, "MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE",
             "shares a view without a byteStride with another accessor");
  }

  const json& d_;
  Notes& notes_;
  std::map<std::size_t, std::string> kinds_;  // of accessors
  std::map<std::size_t, ViewUse> views_;
};

// ---- Images, nodes, skins, animations ---------------------------------------------------------------------------

void audit_images(const json& d, const Place& root, Notes& notes) {
  const json& images = list_of(d, "images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Place place = root.at("images").at(i);
    const json* view = find(images[i], "bufferView");
    if (view == nullptr) continue;
    if (!images[i].contains("mimeType"))
      forbid(notes, place, "UNSATISFIED_DEPENDENCY", "has a bufferView without a mimeType");
    if (d["bufferViews"][view->get<std::size_t>()].contains("byteStride"))
      forbid(notes, place.at("bufferView"), "IMAGE_BUFFER_VIEW_WITH_BYTESTRIDE", "has a byteStride");
  }
}

std::vector<std::optional<std::size_t>> parents_of(const json& nodes) {
  std::vector<std::optional<std::size_t>> parents(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (const json& child : list_of(nodes[n], "children")) parents[child.get<std::size_t>()] = n;
  return parents;
}

void audit_skins(const json& d, const Place& root, Notes& notes) {
  const json &nodes = list_of(d, "nodes"), &skins = list_of(d, "skins"), &scenes = list_of(d, "scenes");
  const std::vector<std::optional<std::size_t>> parents = parents_of(nodes);
  const auto root_of = [&](std::size_t n) {
    while (parents[n]) n = *parents[n];
    return n;
  };
  const auto is_above = [&](std::size_t above, std::size_t n) {
    std::optional<std::size_t> at = n;
    while (at && *at != above) at = parents[*at];
    return at.has_value();
  };
  for (std::size_t s = 0; s < skins.size(); ++s) {
    std::set<std::size_t> roots;
    bool below = true;
    const json* skeleton = find(skins[s], "skeleton");
    for (const json& joint : skins[s]["joints"]) {
      roots.insert(root_of(joint.get<std::size_t>()));
      below = below && (skeleton == nullptr || is_above(skeleton->get<std::size_t>(), joint.get<std::size_t>()));
    }
    const Place place = root.at("skins").at(s);
    if (roots.size() > 1) forbid(notes, place.at("joints"), "SKIN_NO_COMMON_ROOT", "are joints without a common root");
    if (!below && roots.size() == 1)
      forbid(notes, place.at("skeleton"), "SKIN_SKELETON_INVALID", "is not above all joints");
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const json* skin = find(nodes[n], "skin");
    if (skin == nullptr || !nodes[n].contains("mesh")) continue;
    const std::size_t own = root_of(n),
                      joint = root_of(skins[skin->get<std::size_t>()]["joints"][0].get<std::size_t>());
    for (const json& scene : scenes) {
      bool has_own = false, has_joint = false;
      for (const json& listed : list_of(scene, "nodes"))
        has_own |= root_of(listed.get<std::size_t>()) == own, has_joint |= root_of(listed.get<std::size_t>()) == joint;
      if (has_own && !has_joint)
        forbid(notes, root.at("nodes").at(n).at("skin"), "NODE_SKIN_NO_SCENE",
               "has joints outside a scene of its mesh");
    }
  }
}

void audit_nodes(const json& d, const Place& root, Notes& notes) {
  const json& nodes = list_of(d, "nodes");
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    std::set<std::size_t> seen;
    for (const json& child : list_of(nodes[n], "children"))
      if (!seen.insert(child.get<std::size_t>()).second)
        forbid(notes, root.at("nodes").at(n).at("children"), "DUPLICATE_ELEMENTS", "names a node twice");
    if (const json* rotation = find(nodes[n], "rotation"))
      for (const json& c : *rotation)
        if (std::abs(c.get<double>()) > 1)
          forbid(notes, root.at("nodes").at(n).at("rotation"), "VALUE_NOT_IN_RANGE", "has a number beyond 1");
  }
  const json& cameras = list_of(d, "cameras");
  for (std::size_t c = 0; c < cameras.size(); ++c)
    if (cameras[c].contains("perspective") && cameras[c].contains("orthographic"))
      forbid(notes, root.at("cameras").at(c), "ONE_OF_MISMATCH", "has both projections");
}

void audit_animations(const json& d, const Place& root, Notes& notes) {
  const json& animations = list_of(d, "animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const json& samplers = animations[a]["samplers"];
    for (std::size_t s = 0; s < samplers.size(); ++s)
      if (samplers[s].value("interpolation", std::string()) == "CUBICSPLINE" &&
          d["accessors"][samplers[s]["input"].get<std::size_t>()]["count"].get<std::uint64_t>() < 2)
        forbid(notes, root.at("animations").at(a).at("samplers").at(s).at("input"),
               "ANIMATION_SAMPLER_INPUT_ACCESSOR_TOO_FEW_ELEMENTS", "has fewer than two keys of a spline");
  }
}

// An anisotropic material needs tangents: the mesh's own, or ones made from a normal texture's coordinates.
void audit_tangent_spaces(const json& d, const Place& root, Notes& notes) {
  const json &meshes = list_of(d, "meshes"), &materials = list_of(d, "materials");
  for (std::size_t m = 0; m < meshes.size(); ++m)
    for (std::size_t p = 0; p < meshes[m]["primitives"].size(); ++p) {
      const json& primitive = meshes[m]["primitives"][p];
      const json* index = find(primitive, "material");
      if (index == nullptr) continue;
      const json& material = materials[index->get<std::size_t>()];
      if (find_extension(material, "KHR_materials_anisotropy") == nullptr || material.contains("normalTexture"))
        continue;
      if (!primitive["attributes"].contains("TANGENT"))
        forbid(notes, root.at("meshes").at(m).at("primitives").at(p).at("material"), "MESH_PRIMITIVE_NO_TANGENT_SPACE",
               "is anisotropic, and nothing gives the direction");
    }
}

}  // namespace

void audit_document(const json& document, const Place& root, Notes& notes) {
  const std::set<std::string> used = names_of(document, "extensionsUsed");
  audit_asset(document, root, notes);
  audit_extension_lists(document, used, root, notes);
  Anywhere{used, notes}.look(document, "", root);
  audit_accessors(document, root, notes);
  audit_views(document, root, notes);
  UseAudit uses(document, notes);
  for_each_accessor_use(document, root, [&](const AccessorUsed& use, const Place& place) { uses.add(use, place); });
  audit_images(document, root, notes);
  audit_nodes(document, root, notes);
  audit_skins(document, root, notes);
  audit_animations(document, root, notes);
  audit_tangent_spaces(document, root, notes);
}

}  // namespace tessera::scene::gltf
