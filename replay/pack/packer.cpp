#include "replay/pack/packer.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/output_file.h"
#include "base/vec.h"
#include "base/whole_file.h"
#include "replay/pack/binary_chunk.h"
#include "replay/pack/image_packer.h"
#include "replay/pack/lattice.h"
#include "replay/pack/meshopt_encoder.h"
#include "replay/pack/stored_view.h"
#include "scene/capture_reader.h"
#include "scene/cluster_stream.h"
#include "scene/clusters.h"
#include "scene/extensions.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/accessor_uses.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/document.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/meshopt_reader.h"
#include "scene/gltf/validation.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr const char* kQuantization = "KHR_mesh_quantization";
constexpr const char* kClusters = "TESSERA_clusters";
constexpr const char* kMeshoptNames[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

// An extension of a glTF object, or null.
json* extension_of(json& object, const char* name) { return const_cast<json*>(gltf::find_extension(object, name)); }

void add_extension(json& d, const char* list, const std::string& name) {
  json& names = d[list];
  if (!names.is_array()) names = json::array();
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

void drop_extension(json& d, const std::string& name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!d.contains(list)) continue;
    json kept = json::array();
    for (const json& other : d[list])
      if (other != name) kept.push_back(other);
    if (kept.empty())
      d.erase(list);
    else
      d[list] = std::move(kept);
  }
}

// ---- Compressing primitives -------------------------------------------------------------------------------------

// Normalised values as the integers that they are stored as.
void as_integers(std::vector<float>& values, int component_type) {
  const float scale = component_type == gltf::kByte           ? 127.0f
                      : component_type == gltf::kUnsignedByte ? 255.0f
                      : component_type == gltf::kShort        ? 32767.0f
                                                              : 65535.0f;
  for (float& v : values) v = std::round(v * scale);
}

// Scalars of an accessor in Draco's form: normalised integers as their integers. The asset has been read: a value that
// is not finite belongs to a vertex that no index names.
DracoAttribute read_attribute(gltf::Document& document, const std::string& name, std::size_t accessor) {
  const gltf::AccessorLayout layout = gltf::accessor_layout(document.json, accessor);
  DracoAttribute out{name, layout.components, layout.component_type, layout.normalized,
                     gltf::read_floats(document, accessor, [](std::uint64_t) { return false; })};
  if (layout.normalized) as_integers(out.values, layout.component_type);
  return out;
}

// Application-specific attributes ("_NAME") stay outside the stream: only the application knows the effect of rounding
// on them.
bool application_specific(const std::string& attribute) { return attribute.starts_with("_"); }

// Whether something outside the Draco stream depends on the order of the vertices.
bool order_matters(const json& primitive) {
  const json& attributes = primitive["attributes"];
  return primitive.contains("targets") || gltf::find_extension(primitive, "TESSERA_bezier_patches") != nullptr ||
         gltf::find_extension(primitive, "TESSERA_subdivision") != nullptr ||
         std::any_of(attributes.items().begin(), attributes.items().end(),
                     [](const auto& item) { return application_specific(item.key()); });
}

// An accessor without a buffer view, as the Draco extension wants it.
json described_accessor(const DracoAttribute& attribute, std::size_t count) {
  static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  json accessor = {
      {"componentType", attribute.component_type}, {"count", count}, {"type", kTypes[attribute.components]}};
  if (attribute.normalized) accessor["normalized"] = true;
  return accessor;
}

// `values`: of all components, one element after the other.
void set_range(json& accessor, const std::vector<float>& values, std::size_t components) {
  std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(components)), high = low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    low[i % components] = std::min(low[i % components], values[i]);
    high[i % components] = std::max(high[i % components], values[i]);
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

// `mesh`: the number of the primitive's.
DracoInput read_primitive(gltf::Document& document, const json& primitive, const Lattices& lattices, std::size_t mesh,
                          bool meshopt) {
  DracoInput input;
  for (const auto& [name, index] : primitive["attributes"].items())
    if (!application_specific(name))
      input.attributes.push_back(read_attribute(document, name, index.get<std::size_t>()));
  // Positions first: Draco predicts the others from them.
  std::stable_sort(input.attributes.begin(), input.attributes.end(),
                   [](const auto& a, const auto& b) { return a.name == "POSITION" && b.name != "POSITION"; });
  input.vertex_count = input.attributes[0].values.size() / 3;
  if (primitive.contains("indices")) {
    input.indices = gltf::read_unsigned(document, primitive["indices"].get<std::size_t>());
  } else {
    for (std::uint32_t v = 0; v < input.vertex_count; ++v) input.indices.push_back(v);
  }
  input.indices.resize(input.indices.size() / 3 * 3);
  for (DracoAttribute& attribute : input.attributes) {
    // The codec of meshoptimizer rounds all others by their values alone.
    if (!meshopt || attribute.name == "POSITION" || attribute.name.starts_with("TEXCOORD_"))
      lattices.apply(mesh, attribute);
    // An octahedron has no place for a normal that is not of length 1; renderers give one of length 0 a meaning.
    if (attribute.name == "NORMAL") attribute.exact = !is_unit(attribute);
  }
  return input;
}

// A triangle with three different corners; edgebreaker drops the others, and cannot encode a mesh of nothing else.
bool has_proper_triangle(const DracoInput& input) {
  const auto position = [&](std::size_t corner) {
    return std::span(input.attributes[0].values).subspan(3 * input.indices[corner], 3);
  };
  const auto equal = [&](std::size_t a, std::size_t b) { return std::ranges::equal(position(a), position(b)); };
  for (std::size_t i = 0; i < input.indices.size(); i += 3)
    if (!equal(i, i + 1) && !equal(i + 1, i + 2) && !equal(i, i + 2)) return true;
  return false;
}

// Replaces a primitive's data by a Draco stream. Leaves it as it is, and says false, where a stream would be larger or
// cannot be: no proper triangle, or vertices that must keep their order and that triangles hardly use (primitives
// that share the vertices of a whole model).
bool compress_primitive(gltf::Document& document, json& out, json& primitive, const PackOptions& options,
                        const Lattices& lattices, std::size_t mesh, BinaryChunk& chunk) {
  if (primitive.value("mode", 4) != 4 || !primitive["attributes"].contains("POSITION")) return false;
  const bool ordered = order_matters(primitive);
  if (ordered && options.method == PackMethod::kEdgebreaker)
    throw UsageError(
        "--method edgebreaker renumbers vertices; Bezier patches, cages, morph targets and application-specific "
        "attributes need sequential order (or auto)");
  const DracoInput input = read_primitive(document, primitive, lattices, mesh, false);
  const bool sequential = ordered || options.method == PackMethod::kSequential;
  if (sequential ? input.vertex_count > input.indices.size() : !has_proper_triangle(input)) return false;
  const DracoOutput encoded = encode_draco(input, options.bits, sequential);

  json extension = {{"bufferView", chunk.add(encoded.bytes)}, {"attributes", json::object()}};
  for (std::size_t a = 0; a < input.attributes.size(); ++a) {
    primitive["attributes"][input.attributes[a].name] = out["accessors"].size();
    out["accessors"].push_back(described_accessor(input.attributes[a], input.vertex_count));
    extension["attributes"][input.attributes[a].name] = encoded.unique_ids[a];
  }
  primitive["indices"] = out["accessors"].size();
  out["accessors"].push_back({{"componentType", 5125}, {"count", input.indices.size()}, {"type", "SCALAR"}});
  primitive["extensions"][kDraco] = std::move(extension);
  primitive["extensions"].erase(kClusters);
  return true;
}

// New streams of clusters, each by the extension object that will name its view. The chunk has them behind all accessors.
using ClusterStreams = std::map<const json*, std::vector<std::uint8_t>>;

// Encodes positions and triangles as a stream of clusters. `input` keeps the other attributes, with its vertices in the
// order of the stream. Returns false and changes nothing where positions lie on no grid, or blocks of dgf cannot hold them.
bool encode_clusters(scene::GeometryEncoding encoding, DracoInput& input, json& out, json& primitive,
                     ClusterStreams& streams) {
  const auto position = std::find_if(input.attributes.begin(), input.attributes.end(),
                                     [](const DracoAttribute& a) { return a.name == "POSITION"; });
  if (!position->exponent) return false;
  scene::Primitive mesh;
  mesh.in_cluster_order = true;
  mesh.vertices.positions = positions_of(input);
  mesh.indices = input.indices;
  const std::optional<scene::ClusterStream> made = scene::encode_cluster_stream(encoding, *position->exponent, mesh);
  if (!made) return false;
  const scene::ClusterStream& stream = *made;
  std::vector<std::uint32_t> place(input.vertex_count, ~0u);
  for (std::size_t v = 0; v < stream.order.size(); ++v) place[stream.order[v]] = static_cast<std::uint32_t>(v);
  renumber_vertices(input, place, stream.order.size());
  json accessor = described_accessor(*position, input.vertex_count);
  set_range(accessor, position->values, 3);
  primitive["attributes"]["POSITION"] = out["accessors"].size();
  out["accessors"].push_back(std::move(accessor));
  primitive["indices"] = out["accessors"].size();
  out["accessors"].push_back(
      {{"componentType", gltf::kUnsignedInt}, {"count", 3 * stream.triangles}, {"type", "SCALAR"}});
  json& extension = primitive["extensions"][kClusters];
  extension["encoding"] = word(encoding);
  extension["bits"] = stream.bits;
  extension["clusters"] = stream.clusters;
  streams[&extension] = stream.bytes;
  input.attributes.erase(position);
  return true;
}

// As compress_primitive, with meshoptimizer: attributes and indices become compressed views, and `placed` maps
// accessors to their numbers. A primitive that is already compressed in this way keeps its streams.
bool compress_with_meshopt(gltf::Document& document, json& out, json& primitive, const PackOptions& options,
                           const Lattices& lattices, std::size_t mesh, BinaryChunk& chunk,
                           std::map<std::size_t, std::size_t>& placed, ClusterStreams& streams) {
  if (primitive.value("mode", 4) != 4 || !primitive["attributes"].contains("POSITION")) return false;
  const json& position = document.json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
  if (position.contains("bufferView") &&
      gltf::find_meshopt(document.json["bufferViews"][position["bufferView"].get<std::size_t>()]) != nullptr)
    return false;
  const bool ordered = order_matters(primitive);
  DracoInput input = read_primitive(document, primitive, lattices, mesh, true);
  if (input.indices.empty() || (ordered && input.vertex_count > input.indices.size())) return false;
  if (!ordered) {
    order_for_meshopt(input);
    primitive["extensions"][kClusters] = {{"maxVertices", scene::kMaxClusterVertices},
                                          {"maxTriangles", scene::kMaxClusterTriangles},
                                          {"range", scene::kClusterRangeTriangles}};
  }
  const bool in_clusters =
      !ordered && options.geometry && encode_clusters(*options.geometry, input, out, primitive, streams);
  // Views in the order in which packing again comes across them.
  std::sort(input.attributes.begin(), input.attributes.end(),
            [](const DracoAttribute& a, const DracoAttribute& b) { return a.name < b.name; });

  const auto add = [&](json accessor, const MeshoptStream& stream, AccessorUse use) {
    placed[out["accessors"].size()] = chunk.add_stream(stream, use);
    out["accessors"].push_back(std::move(accessor));
    return out["accessors"].size() - 1;
  };
  for (DracoAttribute& attribute : input.attributes) {
    const MeshoptAttribute encoded = encode_attribute(attribute, options.bits);
    attribute.component_type = encoded.component_type;
    attribute.normalized = encoded.normalized;
    json accessor = described_accessor(attribute, input.vertex_count);
    if (attribute.name == "POSITION") set_range(accessor, encoded.decoded, 3);
    const bool small = encoded.component_type != gltf::kFloat;
    if (small && (attribute.name == "NORMAL" || attribute.name == "TANGENT"))
      for (const char* list : {"extensionsUsed", "extensionsRequired"}) add_extension(out, list, kQuantization);
    primitive["attributes"][attribute.name] = add(std::move(accessor), encoded.stream, AccessorUse::kVertices);
  }
  if (in_clusters) return true;
  const bool small = input.vertex_count <= 65535;
  const std::size_t index_bytes = small ? 2 : 4;
  primitive["indices"] =
      add({{"componentType", small ? gltf::kUnsignedShort : gltf::kUnsignedInt},
           {"count", input.indices.size()},
           {"type", "SCALAR"}},
          // Cages of quads count on the first corner of a triangle, too.
          ordered ? encode_indices(input.indices, index_bytes) : encode_triangles(input.indices, index_bytes),
          AccessorUse::kIndices);
  return true;
}

// Counts and position ranges as the streams decode: the encoder may renumber, and quantisation moves positions.
// `document` holds the same objects as `out`.
void describe_decoded(gltf::Document& document, json& out) {
  for (std::size_t m = 0; m < out["meshes"].size(); ++m)
    for (std::size_t p = 0; p < out["meshes"][m]["primitives"].size(); ++p) {
      const json& primitive = out["meshes"][m]["primitives"][p];
      if (gltf::find_extension(primitive, kDraco) == nullptr) continue;
      const gltf::DecodedMesh decoded =
          gltf::read_draco(document, primitive, document.root.at("meshes").at(m).at("primitives").at(p));
      for (const auto& [name, id] : gltf::find_extension(primitive, kDraco)->at("attributes").items()) {
        json& accessor = out["accessors"][primitive["attributes"][name].get<std::size_t>()];
        accessor["count"] = decoded.vertex_count;
        if (name != "POSITION") continue;
        std::vector<float> values = *decoded.find(name);
        if (accessor.value("normalized", false)) as_integers(values, accessor["componentType"].get<int>());
        set_range(accessor, values, 3);
      }
      json& indices = out["accessors"][primitive["indices"].get<std::size_t>()];
      indices["count"] = decoded.indices.size();
      indices["componentType"] = decoded.vertex_count <= 65535 ? 5123 : 5125;
    }
}

// ---- The rest of the document -----------------------------------------------------------------------------------

// Calls visit(index, use) for every place in the document that names an accessor.
void for_each_accessor_use(json& d, const std::function<void(json&, AccessorUse)>& visit) {
  if (d.contains("meshes"))
    for (json& mesh : d["meshes"])
      for (json& primitive : mesh["primitives"]) {
        for (auto& [name, index] : primitive["attributes"].items()) visit(index, AccessorUse::kVertices);
        if (primitive.contains("indices")) visit(primitive["indices"], AccessorUse::kIndices);
        if (primitive.contains("targets"))
          for (json& target : primitive["targets"])
            for (auto& [name, index] : target.items()) visit(index, AccessorUse::kVertices);
      }
  if (d.contains("nodes"))
    for (json& node : d["nodes"]) {
      if (json* instancing = extension_of(node, "EXT_mesh_gpu_instancing"))
        for (auto& [name, index] : (*instancing)["attributes"].items()) visit(index, AccessorUse::kOther);
      if (json* procedure = extension_of(node, "TESSERA_procedure");
          procedure != nullptr && procedure->contains("image"))
        visit((*procedure)["image"]["positions"], AccessorUse::kOther);
    }
  if (d.contains("skins"))
    for (json& skin : d["skins"])
      if (skin.contains("inverseBindMatrices")) visit(skin["inverseBindMatrices"], AccessorUse::kOther);
  if (d.contains("animations"))
    for (json& animation : d["animations"])
      for (json& sampler : animation["samplers"]) {
        visit(sampler["input"], AccessorUse::kOther);
        visit(sampler["output"], AccessorUse::kOther);
      }
}

// glTF requires ranges of positions and key times; where an asset lacks them, they are computed from the values.
void add_missing_ranges(gltf::Document& document, json& out) {
  gltf::for_each_accessor_use(document.json, document.root, [&](const gltf::AccessorUsed& use, const gltf::Place&) {
    const bool positions = use.name == "POSITION" && use.role != gltf::AccessorRole::kInstances;
    if ((!positions && use.role != gltf::AccessorRole::kKeyTimes) || use.in_stream) return;
    json& accessor = out["accessors"][use.accessor];
    if (accessor.contains("min") && accessor.contains("max")) return;
    const DracoAttribute values = read_attribute(document, "", use.accessor);
    if (values.values.empty()) return;
    set_range(accessor, values.values, static_cast<std::size_t>(values.components));
  });
}

// Drops accessors without a reference, renumbers the others and moves their data into the chunk. `placed`: accessors
// whose data is already in the chunk, with their views.
void move_accessors(json& d, BinaryChunk& chunk, const std::map<std::size_t, std::size_t>& placed) {
  std::map<std::pair<std::size_t, AccessorUse>, std::size_t> number;
  json kept = json::array();
  for_each_accessor_use(d, [&](json& index, AccessorUse use) {
    const auto old = index.get<std::size_t>();
    const auto [at, fresh] = number.try_emplace({old, use}, kept.size());
    if (fresh) {
      kept.push_back(d["accessors"][old]);
      if (const auto view = placed.find(old); view != placed.end())
        kept.back()["bufferView"] = view->second;
      else
        chunk.copy_accessor(kept.back(), use);
    }
    index = at->second;
  });
  d["accessors"] = std::move(kept);
  if (d["accessors"].empty()) d.erase("accessors");
}

// Extension objects that Tessera does not know are kept unchanged, so they must not name objects that packing
// renumbers.
void refuse_unknown_references(const json& value, const gltf::Place& place, bool unknown) {
  if (value.is_array())
    for (std::size_t i = 0; i < value.size(); ++i) refuse_unknown_references(value[i], place.at(i), unknown);
  if (!value.is_object()) return;
  for (const auto& [key, inner] : value.items()) {
    if (key == "extras") continue;
    if (unknown && (key == "bufferView" || key == "accessor"))
      place.at(key).refuse("belongs to an extension that Tessera does not know; pack cannot renumber it");
    if (key != "extensions" || !inner.is_object()) {
      refuse_unknown_references(inner, place.at(key), unknown);
      continue;
    }
    std::set<std::string_view> known;
    for (const scene::Extension& e : scene::supported_extensions()) known.insert(e.name);
    for (const auto& [name, object] : inner.items()) {
      if (name == "EXT_structural_metadata" || name == "EXT_feature_metadata")
        place.at(key).at(name).refuse("names buffer views in a way that pack cannot renumber");
      refuse_unknown_references(object, place.at(key).at(name), !known.contains(name));
    }
  }
}

void attach_settings(json& d, const PackOptions& options) {
  if (!options.capture_settings.is_null() && !options.capture_settings.empty()) {
    json& settings = d["extensions"]["TESSERA_capture"];
    for (const auto& [key, value] : options.capture_settings.items()) {
      if (key != "environment" || !settings.contains(key) || settings[key].is_number()) {
        settings[key] = value;
        continue;
      }
      // The environment stays, with another brightness.
      settings[key] = gltf::environment_settings(d);
      settings[key]["intensity"] = value;
    }
    add_extension(d, "extensionsUsed", "TESSERA_capture");
  }
  if (!options.aperture_radius && !options.focus_distance) return;
  if (!d.contains("cameras") || d["cameras"].empty())
    throw UsageError("--aperture and --focus need an asset with a camera");
  for (json& camera : d["cameras"]) {
    json& lens = camera["extensions"]["TESSERA_lens"];
    if (options.aperture_radius) lens["apertureRadius"] = *options.aperture_radius;
    if (options.focus_distance) lens["focusDistance"] = *options.focus_distance;
    if (!lens.contains("apertureRadius"))
      throw UsageError("--focus needs --aperture, or a camera that has a lens already");
  }
  add_extension(d, "extensionsUsed", "TESSERA_lens");
}

// An environment's image moves into the chunk, as it is.
void move_environment(gltf::Document& document, json& d, BinaryChunk& chunk) {
  json environment = gltf::environment_settings(d);
  if (environment.contains("bufferView")) {
    environment["bufferView"] = chunk.copy_view(environment["bufferView"].get<std::size_t>());
  } else if (environment.contains("image")) {
    const gltf::Place place = document.root.at("extensions").at("TESSERA_capture").at("environment");
    environment["bufferView"] = chunk.add(document.resources.file(environment["image"].get<std::string>(), place));
    environment.erase("image");
  } else {
    return;
  }
  d["extensions"]["TESSERA_capture"]["environment"] = std::move(environment);
}

template <class Is>
bool any_primitive(const json& d, const Is& is) {
  for (const json& mesh : d["meshes"])
    for (const json& primitive : mesh["primitives"])
      if (is(primitive)) return true;
  return false;
}

// Moves new streams of clusters and the source's streams into the chunk. Returns their number.
std::size_t move_clusters(json& d, const ClusterStreams& streams, BinaryChunk& chunk) {
  std::size_t count = 0;
  for (json& mesh : d["meshes"])
    for (json& primitive : mesh["primitives"]) {
      if (gltf::find_encoded_clusters(primitive) == nullptr) continue;
      ++count;
      json& extension = *extension_of(primitive, kClusters);
      const auto made = streams.find(&extension);
      extension["bufferView"] =
          made != streams.end() ? chunk.add(made->second) : chunk.copy_view(extension["bufferView"].get<std::size_t>());
    }
  return count;
}

// Updates the extensions to the packed data: removes the ones that were unpacked, adds the ones that compressed it.
void list_extensions(json& d, const BinaryChunk& chunk, bool draco, bool webp) {
  const auto need = [&](const char* name) {
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) add_extension(d, list, name);
  };
  for (const char* name : kMeshoptNames)
    if (chunk.extensions().contains(name))
      need(name);
    else
      drop_extension(d, name);
  drop_extension(d, kClusters);
  if (any_primitive(d, [](const json& p) { return gltf::find_encoded_clusters(p) != nullptr; }))
    need(kClusters);
  else if (any_primitive(d, [](const json& p) { return gltf::find_extension(p, kClusters) != nullptr; }))
    add_extension(d, "extensionsUsed", kClusters);
  if (draco) need(kDraco);
  if (webp) need("EXT_texture_webp");
}

std::string glb_bytes(const json& d, const std::vector<std::uint8_t>& binary) {
  std::string text = d.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out;
  const auto word = [&](std::size_t value) {
    for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(value >> shift & 0xFF));
  };
  const std::size_t padded = (binary.size() + 3) / 4 * 4;
  out += "glTF";
  word(2);
  word(12 + 8 + text.size() + (padded > 0 ? 8 + padded : 0));
  word(text.size());
  out += "JSON" + text;
  if (padded == 0) return out;
  word(padded);
  out += std::string("BIN\0", 4);
  out.append(binary.begin(), binary.end());
  out.resize(out.size() + padded - binary.size(), '\0');
  return out;
}

// A checked document of a file or of bytes in memory.
json checked_json(const std::string& text, const std::string& name) {
  constexpr int kMaxDepth = 1000;  // of extras, which are kept; the reader has limited all else
  json d = parse_json(text, name, kMaxDepth);
  const gltf::Place root(name);
  gltf::Notes notes;  // discarded: the reader makes the notes that count
  gltf::check_schema(d, root, notes);
  gltf::validate_links(d, root, notes);
  return d;
}

// Reads the capture back before it is put in place.
void put_in_place(const std::filesystem::path& target, const std::string& bytes) {
  {
    const bool stream = is_stream(target);  // proved in a file of its own, which is gone before a FIFO blocks
    AtomicFile file(stream ? std::filesystem::temp_directory_path() / "tessera-pack.glb" : target);
    file.write(bytes);
    scene::read_capture(file.temporary());
    if (!stream) return file.commit();
  }
  OutputFile out(target);
  out.write(bytes);
  out.commit();
}

}  // namespace

PackReport pack_capture(const std::filesystem::path& source, const std::filesystem::path& target,
                        const PackOptions& options) {
  PackReport report;
  // Reading it whole first finds every fault that only shows when values are decoded.
  const PackedView looked_at = read_for_view(source, options.capture_settings, options.view, options.strict);
  report.bytes_in = looked_at.capture.file_bytes;

  const std::string name = source.string();
  const scene::CaptureLimits limits;
  constexpr std::uint64_t kReadings = 4;  // of values that fit once: to measure, to join, to encode; none stays
  scene::MemoryBudget budget(kReadings * limits.max_bytes, name);
  gltf::Container container = gltf::open_container(read_whole_file(source, limits.max_file_bytes, name), name);
  json checked = checked_json(container.json, name);
  if (options.surfaces.any()) {
    EditedAsset asset(source, std::move(checked), std::move(container.binary), container.has_binary);
    report.surfaces = edit_surfaces(asset, options.surfaces);
    checked = checked_json(asset.document.dump(), name);
    container.binary = asset.binary();
    container.has_binary = true;
  }
  if (!options.procedures.empty()) {
    attach_procedures(checked, options.procedures);
    checked = checked_json(checked.dump(), name);
  }
  gltf::Document document(std::move(checked), source, std::move(container.binary), container.has_binary, limits,
                          budget);
  json out = document.json;
  if (!out.contains("meshes")) out["meshes"] = json::array();

  refuse_unknown_references(out, document.root, false);
  const bool meshopt = options.method == PackMethod::kMeshopt;
  BinaryChunk chunk(document, meshopt);
  std::map<std::size_t, std::size_t> placed;
  ClusterStreams streams;
  std::size_t draco = 0;
  std::optional<Lattices> lattices;
  if (options.method != PackMethod::kNone) lattices.emplace(document, looked_at.capture, options.bits);
  for (std::size_t m = 0; m < out["meshes"].size(); ++m)
    for (json& primitive : out["meshes"][m]["primitives"]) {
      ++report.primitives;
      if (json* compressed = extension_of(primitive, kDraco))
        (*compressed)["bufferView"] = chunk.copy_view((*compressed)["bufferView"].get<std::size_t>());
      else if (gltf::find_encoded_clusters(primitive) != nullptr)
        continue;
      else if (meshopt)
        report.compressed +=
            compress_with_meshopt(document, out, primitive, options, *lattices, m, chunk, placed, streams) ? 1 : 0;
      else if (options.method != PackMethod::kNone &&
               compress_primitive(document, out, primitive, options, *lattices, m, chunk))
        ++draco;
    }
  report.compressed += draco;
  add_missing_ranges(document, out);
  move_accessors(out, chunk, placed);
  report.in_clusters = move_clusters(out, streams, chunk);
  report.webp_images = move_images(document, out, chunk, options.webp, report.notices);
  list_extensions(out, chunk, draco > 0, report.webp_images > 0);
  attach_settings(out, options);
  store_view(out, options.view, looked_at);
  move_environment(document, out, chunk);
  if (out["meshes"].empty()) out.erase("meshes");
  out.erase("buffers");
  out.erase("bufferViews");
  if (!chunk.bytes().empty()) {
    out["buffers"] = chunk.buffers();
    out["bufferViews"] = chunk.views();
  }

  // A fault that the options bring is reported here, under the target's name.
  const json result = checked_json(out.dump(), target.string());
  if (draco > 0) {
    scene::MemoryBudget second_budget(limits.max_bytes, target.string());
    gltf::Document written(result, target, chunk.bytes(), true, limits, second_budget);
    describe_decoded(written, out);
  }
  const std::string bytes = glb_bytes(out, chunk.bytes());
  put_in_place(target, bytes);
  report.bytes_out = bytes.size();
  return report;
}

}  // namespace tessera::replay
