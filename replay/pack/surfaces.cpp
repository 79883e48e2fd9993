#include "replay/pack/surfaces.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "replay/pack/quad_pairing.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/selection.h"
#include "scene/subdivision/control_cage.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;
namespace subdivision = scene::subdivision;

constexpr const char* kBezier = "TESSERA_bezier_patches";
constexpr const char* kDisplacement = "TESSERA_displacement";

bool has_extension(const json& object, const char* name) { return gltf::find_extension(object, name) != nullptr; }

// The asset as the reader sees it. Edits go to the asset; this view of it does not change.
class Decoded {
 public:
  explicit Decoded(const EditedAsset& asset)
      : budget_(limits_.max_bytes, asset.source().string()),
        document_(asset.document, asset.source(), asset.binary(), true, limits_, budget_) {}

  gltf::Document& document() { return document_; }

  // Calls visit(primitive, its JSON in the asset, place) for the primitives that `wanted` accepts and that draw
  // something.
  template <class Wanted, class Visit>
  void for_each(EditedAsset& asset, const Wanted& wanted, const Visit& visit) {
    const auto meshes = document_.json.find("meshes");
    for (std::size_t m = 0; meshes != document_.json.end() && m < meshes->size(); ++m)
      for (std::size_t p = 0; p < (*meshes)[m]["primitives"].size(); ++p) {
        const json& here = (*meshes)[m]["primitives"][p];
        const gltf::Place place = document_.root.at("meshes").at(m).at("primitives").at(p);
        if (!wanted(here)) continue;
        if (auto primitive = gltf::build_primitive(document_, here, place))
          visit(*primitive, asset.document["meshes"][m]["primitives"][p], place);
      }
  }

 private:
  scene::CaptureLimits limits_;
  scene::MemoryBudget budget_;
  gltf::Document document_;
};

bool is_surface(const json& primitive) {
  return has_extension(primitive, gltf::kSubdivision) || has_extension(primitive, kBezier);
}

// ---- Marking ----------------------------------------------------------------------------------------------------

void mark_cages(EditedAsset& asset, const SurfaceOptions& options, SurfaceReport& report) {
  Decoded decoded(asset);
  const auto plain = [](const json& primitive) { return primitive.value("mode", 4) >= 4 && !is_surface(primitive); };
  decoded.for_each(asset, plain, [&](scene::Primitive& primitive, json& out, const gltf::Place& place) {
    const QuadDominantMesh faces = pair_into_quads(primitive, std::min(45.0, options.crease_degrees.value_or(45.0)));
    subdivision::CageRules rules;
    rules.levels = *options.subdivide;
    rules.quads = faces.quads;
    primitive.indices = faces.indices;
    if (options.crease_degrees)
      for (const auto& [a, b] : edges_sharper_than(primitive, faces.quads, *options.crease_degrees))
        rules.creases.push_back({{a, b}, subdivision::kInfinitelySharp});
    try {
      if (rules.levels == 0 && faces.triangles > 0)
        throw subdivision::CageError(
            fmt::format("{} of its faces are triangles; --subdivide 0 needs quads only", faces.triangles));
      subdivision::build_cage(primitive, rules);
    } catch (const subdivision::CageError& error) {
      report.notices.push_back(fmt::format("{} stays as it is: {}", place.pointer(), error.what()));
      return;
    }
    asset.write_primitive(out, primitive, primitive.indices);
    json& extension = out["extensions"][gltf::kSubdivision];
    extension = {{"scheme", "catmullClark"}, {"levels", rules.levels}, {"quads", rules.quads}};
    for (const subdivision::SharpFeature& crease : rules.creases)
      extension["creases"].push_back({{"vertices", crease.vertices}});
    ++report.cages;
    report.quads += faces.quads;
    report.triangles += faces.triangles;
  });
  if (report.cages > 0)
    asset.use_extension(gltf::kSubdivision);
  else if (report.notices.empty())
    throw UsageError("--subdivide: the asset has no mesh of triangles that is not a cage already");
  else
    throw UsageError(fmt::format("--subdivide: no mesh of the asset can be a cage: {}", report.notices.front()));
}

// Rewritten primitives are not compressed any more.
void drop_unused_draco(EditedAsset& asset) {
  constexpr const char* kDracoName = "KHR_draco_mesh_compression";
  for (const json& mesh : asset.document["meshes"])
    for (const json& primitive : mesh["primitives"])
      if (has_extension(primitive, kDracoName)) return;
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) asset.drop_extension(list, kDracoName);
}

// ---- Converting -------------------------------------------------------------------------------------------------

void convert_cages(EditedAsset& asset, SurfaceReport& report) {
  Decoded decoded(asset);
  const auto cage = [](const json& primitive) { return has_extension(primitive, gltf::kSubdivision); };
  decoded.for_each(asset, cage, [&](scene::Primitive& primitive, json& out, const gltf::Place& place) {
    gltf::subdivide(decoded.document(), out, place, primitive);
    const std::size_t patches = primitive.vertices.count() / 16;
    asset.write_primitive(out, primitive, cage_indices(patches));
    out["extensions"].erase(gltf::kSubdivision);
    out["extensions"][kBezier] = {{"count", patches}};
    report.patches += patches;
  });
  if (report.patches == 0)
    throw UsageError("--convert: the asset has no TESSERA_subdivision cage; --subdivide makes some");
  asset.use_extension(kBezier);
  asset.drop_extension("extensionsUsed", gltf::kSubdivision);
}

// ---- Displacing -------------------------------------------------------------------------------------------------

// A texture of a material itself, by the name of its role; null when it has none.
const json* own_texture(const json& material, const std::string& role) {
  static const std::map<std::string, json::json_pointer> kRoles = {
      {"base-color", json::json_pointer("/pbrMetallicRoughness/baseColorTexture")},
      {"metallic-roughness", json::json_pointer("/pbrMetallicRoughness/metallicRoughnessTexture")},
      {"normal", json::json_pointer("/normalTexture")},
      {"occlusion", json::json_pointer("/occlusionTexture")},
      {"emissive", json::json_pointer("/emissiveTexture")}};
  const auto found = kRoles.find(role);
  if (found == kRoles.end()) return nullptr;
  return material.contains(found->second) ? &material[found->second] : nullptr;
}

bool is_role(const std::string& text) {
  return text == "base-color" || text == "metallic-roughness" || text == "normal" || text == "occlusion" ||
         text == "emissive";
}

bool is_number(const std::string& text) {
  return !text.empty() && text.size() < 9 && text.find_first_not_of("0123456789") == std::string::npos;
}

std::size_t embed_image(EditedAsset& asset, const std::string& file) {
  const std::vector<std::uint8_t> bytes = read_whole_file(file, scene::CaptureLimits{}.max_file_bytes, file);
  DecodedImage image;
  std::string fault;
  if (!decode_image(bytes, ImageLimits{}, image, fault)) throw InputError(file, "", fault);
  json& d = asset.document;
  const ImageFormat format = image_format(bytes);
  d["images"].push_back({{"bufferView", asset.add_view(bytes)}, {"mimeType", mime_type(format)}});
  const json source = {{"source", d["images"].size() - 1}};
  if (format == ImageFormat::kWebp) {
    d["textures"].push_back({{"extensions", {{"EXT_texture_webp", source}}}});
    asset.use_extension("EXT_texture_webp");
  } else {
    d["textures"].push_back(source);
  }
  return d["textures"].size() - 1;
}

// The texture of TESSERA_displacement for a material.
class HeightSource {
 public:
  HeightSource(EditedAsset& asset, const std::string& heights) : heights_(heights) {
    if (is_role(heights)) return;
    const json& d = asset.document;
    if (!is_number(heights)) {
      texture_ = embed_image(asset, heights);
    } else {
      texture_ = std::stoul(heights);
      const std::size_t count = d.contains("textures") ? d["textures"].size() : 0;
      if (*texture_ >= count) throw UsageError(fmt::format("--displace {}: the asset has {} textures", heights, count));
    }
  }

  json texture_info(const json& material, std::size_t number) const {
    if (texture_) return {{"index", *texture_}};
    const json* own = own_texture(material, heights_);
    if (own == nullptr)
      throw UsageError(fmt::format("--displace {}: material {} has no such texture", heights_, number));
    json info = {{"index", (*own)["index"]}};
    for (const char* member : {"texCoord", "extensions"})
      if (own->contains(member)) info[member] = (*own)[member];
    return info;
  }

 private:
  std::string heights_;
  std::optional<std::size_t> texture_;
};

struct Displaced {
  std::vector<json*> primitives;
  double extent = 0;  // the largest side of the box of any one of them
};

Displaced find_surfaces(EditedAsset& asset) {
  Displaced out;
  Decoded decoded(asset);
  decoded.for_each(asset, is_surface, [&](scene::Primitive& primitive, json& json_primitive, const gltf::Place&) {
    Vec3 low = primitive.vertices.positions.front(), high = low;
    for (const Vec3& p : primitive.vertices.positions) low = glm::min(low, p), high = glm::max(high, p);
    for (int axis = 0; axis < 3; ++axis) out.extent = std::max(out.extent, static_cast<double>(high[axis] - low[axis]));
    out.primitives.push_back(&json_primitive);
  });
  return out;
}

// A scale of so few digits that people can read and change it.
double two_digits(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::stod(fmt::format("{:.2g}", std::round(value / unit) * unit));
}

// The primitive's own material, and the materials that variants give it.
std::set<std::size_t> materials_of(const json& primitive) {
  std::set<std::size_t> numbers = {primitive["material"].get<std::size_t>()};
  if (const json* variants = gltf::find_extension(primitive, gltf::kVariants))
    for (const json& mapping : (*variants)["mappings"]) numbers.insert(mapping["material"].get<std::size_t>());
  return numbers;
}

void displace_surfaces(EditedAsset& asset, const SurfaceOptions::Displace& options, SurfaceReport& report) {
  const Displaced surfaces = find_surfaces(asset);
  if (surfaces.primitives.empty())
    throw UsageError("--displace: the asset has neither cages nor Bezier patches; --subdivide makes some");
  const HeightSource heights(asset, options.heights);
  json& materials = asset.document["materials"];
  if (!materials.is_array()) materials = json::array();
  std::optional<std::size_t> fresh;  // for primitives without a material
  std::set<std::size_t> displaced;
  for (json* primitive : surfaces.primitives) {
    if (!primitive->contains("material")) {
      if (!fresh) fresh = materials.size(), materials.push_back(json::object());
      (*primitive)["material"] = *fresh;
    }
    for (const std::size_t number : materials_of(*primitive)) {
      json& material = materials[number];
      const json info = heights.texture_info(material, number);
      const std::string set = fmt::format("TEXCOORD_{}", info.value("texCoord", 0));
      if (!(*primitive)["attributes"].contains(set))
        throw UsageError(fmt::format("--displace: a mesh of material {} lacks {}", number, set));
      material["extensions"][kDisplacement] = {{"texture", info},
                                               {"scale", options.scale.value_or(two_digits(0.02 * surfaces.extent))},
                                               {"bias", options.bias.value_or(0.0)}};
      displaced.insert(number);
    }
  }
  report.displaced_materials = displaced.size();
  asset.use_extension(kDisplacement);
}

}  // namespace

SurfaceOptions::Displace parse_displace(const std::string& text) {
  SurfaceOptions::Displace out;
  const std::size_t first = text.find(','), second = first == std::string::npos ? first : text.find(',', first + 1);
  out.heights = text.substr(0, first);
  const auto number = [&](const std::string& part) {
    try {
      std::size_t used = 0;
      const double value = std::stod(part, &used);
      if (used == part.size() && std::isfinite(value)) return value;
    } catch (const std::logic_error&) {
      // not a number: refused below
    }
    throw UsageError(fmt::format("--displace {}: expected HEIGHTS[,SCALE[,BIAS]]", escape_control(text, 80)));
  };
  if (first != std::string::npos)
    out.scale = number(text.substr(first + 1, second == std::string::npos ? second : second - first - 1));
  if (second != std::string::npos) out.bias = number(text.substr(second + 1));
  if (out.heights.empty()) throw UsageError("--displace: expected HEIGHTS[,SCALE[,BIAS]]");
  return out;
}

SurfaceReport edit_surfaces(EditedAsset& asset, const SurfaceOptions& options) {
  SurfaceReport report;
  if (!asset.document.contains("meshes")) asset.document["meshes"] = json::array();
  if (options.subdivide) mark_cages(asset, options, report);
  if (options.convert) convert_cages(asset, report);
  drop_unused_draco(asset);
  if (options.displace) displace_surfaces(asset, *options.displace, report);
  return report;
}

}  // namespace tessera::replay
