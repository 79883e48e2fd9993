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
#include "scene/gltf/selection.h"

namespace tessera::scene::gltf {
namespace validation {

using nlohmann::json;

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

std::size_t target_count(const json& mesh) {
  std::size_t count = 0;
  for (const json& primitive : mesh["primitives"])
    if (const json* targets = find(primitive, "targets")) count = std::max(count, targets->size());
  return count;
}

namespace {

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
  for (const json& name : list_of(d, "extensionsRequired")) {
    const auto& text = name.get_ref<const std::string&>();
    const auto& known = supported_extensions();
    if (std::none_of(known.begin(), known.end(), [&](const Extension& e) { return e.name == text; }))
      missing.push_back(escape_control(text, 60));
  }
  if (!missing.empty())
    root.at("extensionsRequired")
        .refuse("requires extensions that Tessera does not support: {}", fmt::join(missing, ", "));
}

// ---- Views and accessors ----------------------------------------------------------------------------------------

void check_buffer_views(const json& d, const Place& root, Notes& notes) {
  const auto empty = [&](const Place& place) {
    notes.violation(place.at("byteLength"), "holds nothing", "is 0, outside [1, 9007199254740992]");
  };
  const json& buffers = list_of(d, "buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i)
    if (buffers[i]["byteLength"].get<double>() == 0) empty(root.at("buffers").at(i));
  const json& views = list_of(d, "bufferViews");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto offset = views[i].value("byteOffset", std::uint64_t{0}),
               length = views[i]["byteLength"].get<std::uint64_t>();
    const auto size = d["buffers"][views[i]["buffer"].get<std::size_t>()]["byteLength"].get<std::uint64_t>();
    if (offset > size || length > size - offset)
      root.at("bufferViews")
          .at(i)
          .refuse("bytes {} to {} lie outside its buffer of {} bytes", offset, offset + length, size);
    const Place place = root.at("bufferViews").at(i);
    if (length == 0) empty(place);
    if (views[i].value("byteStride", 4) % 4 != 0)
      notes.violation(place.at("byteStride"), "taken as it is", "is not a multiple of 4");
    if (const json* target = find(views[i], "target"); target != nullptr && *target != 34962 && *target != 34963)
      notes.violation(place.at("target"), "targets mean nothing here", "is {}, which glTF does not define here",
                      escape_control(target->dump(), 40));
  }
}

// `count` elements of `bytes` bytes, the last one of `last`, `stride` apart from `offset`, lie inside the view.
void check_range(const json& d, std::size_t view, std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                 std::uint64_t bytes, std::uint64_t last, std::uint64_t alignment, const Place& place) {
  const json& v = d["bufferViews"][view];
  const auto length = v["byteLength"].get<std::uint64_t>();
  if (stride < bytes) place.refuse("elements of {} bytes do not fit the view's stride of {}", bytes, stride);
  if (stride % alignment != 0)
    place.refuse("has a view whose stride of {} is not a multiple of its component size, {}", stride, alignment);
  // count and stride are below 2^31 and 2^8: no overflow.
  const std::uint64_t needed = count == 0 ? 0 : (count - 1) * stride + last;
  if (offset > length || needed > length - offset)
    place.refuse("needs bytes {} to {} of a view of {} bytes", offset, offset + needed, length);
  if ((offset + v.value("byteOffset", std::uint64_t{0})) % alignment != 0)
    place.refuse("does not start at a multiple of its component size, {}", alignment);
}

void check_accessors(const json& d, const Place& root, Notes& notes) {
  const json& accessors = list_of(d, "accessors");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const Place place = root.at("accessors").at(i);
    const AccessorLayout layout = accessor_layout(d, i);
    const std::uint64_t size = component_bytes(layout.component_type);
    if (accessors[i].value("normalized", false) && !layout.normalized)
      notes.violation(place.at("normalized"), "taken for false", "is true for a component type that cannot be");
    if (layout.has_view)
      check_range(d, accessors[i]["bufferView"].get<std::size_t>(), layout.byte_offset, layout.count, layout.stride,
                  layout.element_bytes, layout.last_bytes(), size, place);
    if (layout.count == 0) notes.violation(place.at("count"), "holds nothing", "is 0, outside [1, 2147483647]");
    const json* sparse = find(accessors[i], "sparse");
    if (sparse == nullptr) continue;
    const Place inner = place.at("sparse");
    const auto count = (*sparse)["count"].get<std::uint64_t>();
    if (count == 0) notes.violation(inner.at("count"), "holds nothing", "is 0, outside [1, 2147483647]");
    if (count > layout.count) inner.at("count").refuse("is {}, the accessor has {} elements", count, layout.count);
    const json &indices = (*sparse)["indices"], &values = (*sparse)["values"];
    const std::uint64_t index_size = component_bytes(indices["componentType"].get<int>());
    check_range(d, indices["bufferView"].get<std::size_t>(), indices.value("byteOffset", std::uint64_t{0}), count,
                index_size, index_size, index_size, index_size, inner.at("indices"));
    check_range(d, values["bufferView"].get<std::size_t>(), values.value("byteOffset", std::uint64_t{0}), count,
                layout.element_bytes, layout.element_bytes, layout.last_bytes(), size, inner.at("values"));
  }
}

// ---- Images and textures ----------------------------------------------------------------------------------------

void check_images(const json& d, const Place& root, Notes& notes) {
  const json& images = list_of(d, "images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Place place = root.at("images").at(i);
    if (images[i].contains("uri") && images[i].contains("bufferView"))
      place.refuse("needs either a uri or a bufferView");
    if (!images[i].contains("uri") && !images[i].contains("bufferView"))
      notes.violation(place, "nothing may sample it", "needs either a uri or a bufferView");
  }
}

// ---- Nodes and scenes -------------------------------------------------------------------------------------------

void check_matrix(const json& matrix, const Place& place, Notes& notes) {
  std::array<double, 16> m;
  for (std::size_t i = 0; i < 16; ++i) m[i] = matrix[i].get<double>();
  const double off = std::max({std::abs(m[3]), std::abs(m[7]), std::abs(m[11]), std::abs(m[15] - 1)});
  if (off > kMatrixRounding) place.refuse("has a last row that is not 0 0 0 1");
  if (off > 0) notes.violation(place, "taken for 0 0 0 1", "has a last row that is not 0 0 0 1 but nearly so");
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
        return notes.violation(place, "such matrices are taken as they are",
                               "shears: it is not a translation, rotation and scale");
    }
}

void check_node(const json& d, std::size_t i, const Place& place, Notes& notes) {
  const json& node = d["nodes"][i];
  if (const json* matrix = find(node, "matrix")) {
    for (const char* name : {"translation", "rotation", "scale"})
      if (node.contains(name)) notes.violation(place, "its matrix holds", "has both a matrix and a {}", name);
    check_matrix(*matrix, place.at("matrix"), notes);
  }
  if (const json* rotation = find(node, "rotation")) {
    double length2 = 0;
    for (const json& c : *rotation) length2 += c.get<double>() * c.get<double>();
    if (!(length2 > kLeastQuaternion && length2 < 1 / kLeastQuaternion))
      place.at("rotation").refuse("is not a unit quaternion: length {:g}", std::sqrt(length2));
    if (std::abs(length2 - 1.0) > 0.01)
      notes.violation(place.at("rotation"), "such rotations are normalised", "is not a unit quaternion: length {:g}",
                      std::sqrt(length2));
  }
  constexpr const char* kNoMesh = "needs a mesh on the same node";
  if (node.contains("skin") && !node.contains("mesh"))
    notes.violation(place.at("skin"), "the skin is ignored", "{}", kNoMesh);
  if (const json* weights = find(node, "weights")) {
    const json* mesh = find(node, "mesh");
    const std::size_t targets = mesh == nullptr ? 0 : target_count(d["meshes"][mesh->get<std::size_t>()]);
    if (mesh == nullptr)
      notes.violation(place.at("weights"), "the weights are ignored", "need a mesh on the same node");
    else if (weights->size() != targets)
      notes.violation(place.at("weights"), "the others are zero or ignored", "are {}, the mesh has {} morph targets",
                      weights->size(), targets);
  }
}

// Attributes of instances other than these are the application's own; as many as the others all the same.
void check_instancing(const json& d, const json& node, const Place& place) {
  const json* instancing = find_extension(node, "EXT_mesh_gpu_instancing");
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
void check_node_graph(const json& d, const Place& root, Notes& notes) {
  const json& nodes = list_of(d, "nodes");
  std::vector<std::optional<std::size_t>> parent(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Place place = root.at("nodes").at(i);
    check_node(d, i, place, notes);
    check_instancing(d, nodes[i], place);
    if (const json* procedure = find_extension(nodes[i], "TESSERA_procedure"))
      check_procedure_links(d, *procedure, place.at("extensions").at("TESSERA_procedure"));
    const json* children = find(nodes[i], "children");
    for (std::size_t k = 0; children != nullptr && k < children->size(); ++k) {
      const auto child = (*children)[k].get<std::size_t>();
      if (parent[child])
        place.at("children").at(k).refuse("is node {}, which has a parent already: node {}", child, *parent[child]);
      parent[child] = i;
    }
  }
  // Each node has at most one parent, so a node that no parentless node reaches hangs on a cycle.
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
  const json& scenes = list_of(d, "scenes");
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    const json* list = find(scenes[s], "nodes");
    std::set<std::size_t> seen;
    for (std::size_t k = 0; list != nullptr && k < list->size(); ++k) {
      const Place place = root.at("scenes").at(s).at("nodes").at(k);
      const auto node = (*list)[k].get<std::size_t>();
      if (parent[node])
        notes.violation(place, "drawn once, where its parents put it", "is node {}, which is not a root", node);
      if (!seen.insert(node).second) notes.violation(place, "drawn once", "lists node {} twice", node);
    }
  }
}

// ---- Skins, animations ------------------------------------------------------------------------------------------

void check_skins(const json& d, const Place& root, Notes& notes) {
  const json& skins = list_of(d, "skins");
  for (std::size_t s = 0; s < skins.size(); ++s) {
    const Place place = root.at("skins").at(s);
    std::set<std::size_t> seen;
    const json& joints = skins[s]["joints"];
    for (std::size_t k = 0; k < joints.size(); ++k)
      if (!seen.insert(joints[k].get<std::size_t>()).second)
        notes.violation(place.at("joints").at(k), "both follow it", "names a joint twice");
    if (const json* matrices = find(skins[s], "inverseBindMatrices")) {
      const auto accessor = matrices->get<std::size_t>();
      check_format(d, accessor, {{16}, {kFloat}, {}}, place.at("inverseBindMatrices"));
      const auto count = d["accessors"][accessor]["count"].get<std::uint64_t>();
      if (count < joints.size())
        place.at("inverseBindMatrices").refuse("are {}, there are {} joints", count, joints.size());
    }
  }
  // A skinned mesh ignores its node's transform; viewers disagree about one without joints.
  const json& nodes = list_of(d, "nodes");
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (!nodes[n].contains("skin") || !nodes[n].contains("mesh")) continue;
    for (const json& primitive : d["meshes"][nodes[n]["mesh"].get<std::size_t>()]["primitives"])
      if (!primitive["attributes"].contains("JOINTS_0"))
        root.at("nodes").at(n).at("skin").refuse("needs a mesh with JOINTS_0 and WEIGHTS_0");
  }
}

// ---- Cameras, lights, Tessera's own settings --------------------------------------------------------------------

void check_cameras(const json& d, const Place& root) {
  const json& cameras = list_of(d, "cameras");
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

void check_lights(const json& d, const Place& root, Notes& notes) {
  const json* extension_json = find_extension(d, "KHR_lights_punctual");
  if (extension_json == nullptr) return;
  const json& lights = (*extension_json)["lights"];
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const Place place = root.at("extensions").at("KHR_lights_punctual").at("lights").at(l);
    if (lights[l]["type"] != "spot") continue;
    const json* spot = find(lights[l], "spot");
    if (spot == nullptr) {
      notes.violation(place, "its cone is the default one", "is a spot light without a spot property");
      continue;
    }
    if (!(spot->value("innerConeAngle", 0.0) < spot->value("outerConeAngle", 0.7853981633974483)))
      notes.violation(place.at("spot"), "such cones have a sharp edge",
                      "has an inner cone that is not smaller than the outer one");
  }
}

void check_shadows(const json& d, const json& shadows, const Place& place) {
  std::map<std::size_t, std::size_t> first_of;  // by light
  for (std::size_t s = 0; s < shadows.size(); ++s) {
    const auto light = shadows[s]["light"].get<std::size_t>();
    const auto [found, fresh] = first_of.try_emplace(light, s);
    if (!fresh) place.at(s).at("light").refuse("is light {}, which shadows/{} names already", light, found->second);
    const auto& type = d["extensions"]["KHR_lights_punctual"]["lights"][light]["type"].get_ref<const std::string&>();
    if (type == "directional") continue;
    if (shadows[s].value("cascades", 1) > 1)
      place.at(s).at("cascades").refuse("need a directional light, light {} is a {} light", light, type);
    if (shadows[s].value("distance", 0.0) > 0)
      place.at(s).at("distance").refuse("needs a directional light, light {} is a {} light", light, type);
  }
}

void check_capture_settings(const json& d, const Place& root) {
  const json* settings = find_extension(d, "TESSERA_capture");
  if (settings == nullptr) return;
  const Place place = root.at("extensions").at("TESSERA_capture");
  if (const json* shutter = find(*settings, "shutter"))
    if ((*shutter)[0].get<double>() > (*shutter)[1].get<double>()) place.at("shutter").refuse("closes before it opens");
  if (const json* camera = find(*settings, "camera"))
    if (!d["nodes"][camera->get<std::size_t>()].contains("camera"))
      place.at("camera").refuse("is a node without a camera");
  if (const json* shadows = find(*settings, "shadows")) check_shadows(d, *shadows, place.at("shadows"));
  check_passes(*settings, place);
}

}  // namespace
}  // namespace validation

void validate_links(const nlohmann::json& d, const Place& root, Notes& notes) {
  using namespace validation;
  check_version(d, root);
  check_required_extensions(d, root);
  check_buffer_views(d, root, notes);
  check_meshopt(d, root);
  check_accessors(d, root, notes);
  check_images(d, root, notes);
  check_node_graph(d, root, notes);
  check_meshes(d, root, notes);
  check_variants(d, root, notes);
  check_skins(d, root, notes);
  check_animations(d, root, notes);
  check_cameras(d, root);
  check_lights(d, root, notes);
  check_capture_settings(d, root);
}

}  // namespace tessera::scene::gltf
