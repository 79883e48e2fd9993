#include "replay/pack/packer.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/json_text.h"
#include "base/output_file.h"
#include "base/whole_file.h"
#include "replay/pack/binary_chunk.h"
#include "scene/capture_reader.h"
#include "scene/extensions.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/container.h"
#include "scene/gltf/document.h"
#include "scene/gltf/schema.h"
#include "scene/gltf/validation.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr const char* kDraco = "KHR_draco_mesh_compression";

// An extension of a glTF object, or null.
json* extension_of(json& object, const char* name) { return const_cast<json*>(gltf::find_extension(object, name)); }

// ---- Compressing primitives -------------------------------------------------------------------------------------

// Scalars of an accessor as Draco wants them: normalised integers as the integers they are.
DracoAttribute read_attribute(gltf::Document& document, const std::string& name, std::size_t accessor) {
  const gltf::AccessorLayout layout = gltf::accessor_layout(document.json, accessor);
  DracoAttribute out{name, layout.components, layout.component_type, layout.normalized,
                     gltf::read_floats(document, accessor)};
  if (layout.normalized)
    for (float& v : out.values) {
      const float scale = layout.component_type == gltf::kByte           ? 127.0f
                          : layout.component_type == gltf::kUnsignedByte ? 255.0f
                          : layout.component_type == gltf::kShort        ? 32767.0f
                                                                         : 65535.0f;
      v = std::round(v * scale);
    }
  return out;
}

// Application-specific attributes ("_NAME") stay outside the stream: nobody but the application knows what rounding
// does to them.
bool application_specific(const std::string& attribute) { return attribute.starts_with("_"); }

// Whether something outside the Draco stream counts on the order of the vertices.
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

void set_position_range(json& accessor, const std::vector<float>& positions) {
  std::vector<float> low(positions.begin(), positions.begin() + 3), high = low;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], positions[i]);
    high[i % 3] = std::max(high[i % 3], positions[i]);
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

DracoInput read_primitive(gltf::Document& document, const json& primitive) {
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
                        BinaryChunk& chunk) {
  if (primitive.value("mode", 4) != 4 || !primitive["attributes"].contains("POSITION")) return false;
  const bool ordered = order_matters(primitive);
  if (ordered && options.method == PackMethod::kEdgebreaker)
    throw UsageError(
        "--method edgebreaker renumbers vertices; Bezier patches, cages, morph targets and application-specific "
        "attributes need sequential order (or auto)");
  const DracoInput input = read_primitive(document, primitive);
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
  return true;
}

// Counts and position ranges as the streams decode: the encoder may renumber, and quantisation moves positions.
// `document` holds the same objects as `out`.
void describe_decoded(gltf::Document& document, json& out) {
  for (std::size_t m = 0; m < out["meshes"].size(); ++m)
    for (std::size_t p = 0; p < out["meshes"][m]["primitives"].size(); ++p) {
      const json& primitive = out["meshes"][m]["primitives"][p];
      if (gltf::find_extension(primitive, kDraco) == nullptr) continue;
      const gltf::DracoMesh decoded =
          gltf::read_draco(document, primitive, document.root.at("meshes").at(m).at("primitives").at(p));
      for (const auto& [name, id] : gltf::find_extension(primitive, kDraco)->at("attributes").items()) {
        json& accessor = out["accessors"][primitive["attributes"][name].get<std::size_t>()];
        accessor["count"] = decoded.vertex_count;
        if (name == "POSITION") set_position_range(accessor, *decoded.find(name));
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

// Drops accessors that nothing names, renumbers the others and moves their data into the chunk.
void move_accessors(json& d, BinaryChunk& chunk) {
  std::map<std::pair<std::size_t, AccessorUse>, std::size_t> number;
  json kept = json::array();
  for_each_accessor_use(d, [&](json& index, AccessorUse use) {
    const auto old = index.get<std::size_t>();
    const auto [at, fresh] = number.try_emplace({old, use}, kept.size());
    if (fresh) {
      kept.push_back(d["accessors"][old]);
      chunk.copy_accessor(kept.back(), use);
    }
    index = at->second;
  });
  d["accessors"] = std::move(kept);
  if (d["accessors"].empty()) d.erase("accessors");
}

void move_images(gltf::Document& document, json& d, BinaryChunk& chunk) {
  if (!d.contains("images")) return;
  std::map<std::string, std::size_t> view_of_uri;
  for (std::size_t i = 0; i < d["images"].size(); ++i) {
    json& image = d["images"][i];
    const gltf::Bytes bytes = document.resources.image(i);
    const ImageFormat format = image_format(bytes);
    if (format == ImageFormat::kUnknown) document.root.at("images").at(i).refuse("is neither PNG nor JPEG");
    image["mimeType"] = format == ImageFormat::kJpeg ? "image/jpeg" : "image/png";
    if (image.contains("bufferView")) {
      image["bufferView"] = chunk.copy_view(image["bufferView"].get<std::size_t>());
      continue;
    }
    const auto [at, fresh] = view_of_uri.try_emplace(image["uri"].get<std::string>(), 0);
    if (fresh) at->second = chunk.add(bytes);
    image["bufferView"] = at->second;
    image.erase("uri");
  }
}

// Extension objects that Tessera does not know are kept as they are, so they must not name what packing renumbers.
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

void add_extension(json& d, const char* list, const std::string& name) {
  json& names = d[list];
  if (!names.is_array()) names = json::array();
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

void attach_settings(json& d, const PackOptions& options) {
  if (!options.capture_settings.is_null() && !options.capture_settings.empty()) {
    json& settings = d["extensions"]["TESSERA_capture"];
    for (const auto& [key, value] : options.capture_settings.items()) settings[key] = value;
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
  json d = parse_json(text, name);
  const gltf::Place root(name);
  gltf::check_schema(d, root);
  gltf::Notes notes;  // the reader's own are those that count
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
  report.bytes_in = scene::read_capture(source, {.strict = options.strict}).file_bytes;

  const std::string name = source.string();
  const scene::CaptureLimits limits;
  scene::MemoryBudget budget(limits.max_bytes);
  gltf::Container container = gltf::open_container(read_whole_file(source, limits.max_file_bytes, name), name);
  json checked = checked_json(container.json, name);
  if (options.surfaces.any()) {
    EditedAsset asset(source, std::move(checked), std::move(container.binary), container.has_binary);
    report.surfaces = edit_surfaces(asset, options.surfaces);
    checked = checked_json(asset.document.dump(), name);
    container.binary = asset.binary();
    container.has_binary = true;
  }
  gltf::Document document(std::move(checked), source, std::move(container.binary), container.has_binary, limits,
                          budget);
  json out = document.json;
  if (!out.contains("meshes")) out["meshes"] = json::array();

  refuse_unknown_references(out, document.root, false);
  BinaryChunk chunk(document);
  for (json& mesh : out["meshes"])
    for (json& primitive : mesh["primitives"]) {
      ++report.primitives;
      if (json* packed = extension_of(primitive, kDraco))
        (*packed)["bufferView"] = chunk.copy_view((*packed)["bufferView"].get<std::size_t>());
      else if (options.method != PackMethod::kNone && compress_primitive(document, out, primitive, options, chunk))
        ++report.compressed;
    }
  if (report.compressed > 0) {
    add_extension(out, "extensionsUsed", kDraco);
    add_extension(out, "extensionsRequired", kDraco);
  }
  move_accessors(out, chunk);
  move_images(document, out, chunk);
  attach_settings(out, options);
  if (out["meshes"].empty()) out.erase("meshes");
  out.erase("buffers");
  out.erase("bufferViews");
  if (!chunk.bytes().empty()) {
    out["buffers"] = json::array({{{"byteLength", chunk.bytes().size()}}});
    out["bufferViews"] = chunk.views();
  }

  // A fault that the options bring is reported here, under the target's name.
  const json result = checked_json(out.dump(), target.string());
  if (report.compressed > 0) {
    scene::MemoryBudget second_budget(limits.max_bytes);
    gltf::Document packed(result, target, chunk.bytes(), true, limits, second_budget);
    describe_decoded(packed, out);
  }
  const std::string bytes = glb_bytes(out, chunk.bytes());
  put_in_place(target, bytes);
  report.bytes_out = bytes.size();
  return report;
}

}  // namespace tessera::replay
