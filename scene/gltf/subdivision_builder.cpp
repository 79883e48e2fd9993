#include "scene/gltf/builders.h"

#include "scene/subdivision/control_cage.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

const json* subdivision_of(const json& primitive) { return find_extension(primitive, kSubdivision); }

Place extension_place(const Place& primitive) { return primitive.at("extensions").at(kSubdivision); }

// Calls visit(feature, its place) for the entries of "creases" or "corners".
template <class Visit>
void for_each_feature(const json& extension, const char* list, const Place& place, const Visit& visit) {
  const auto found = extension.find(list);
  for (std::size_t i = 0; found != extension.end() && i < found->size(); ++i) visit((*found)[i], place.at(list).at(i));
}

subdivision::SharpFeature feature_of(const json& entry) {
  return {entry["vertices"].get<std::vector<std::uint32_t>>(), entry.value("sharpness", subdivision::kInfinitelySharp)};
}

subdivision::CageRules rules_of(const json& extension, const Place& place) {
  subdivision::CageRules rules;
  rules.levels = extension.value("levels", subdivision::kDefaultLevels);
  rules.quads = extension.value("quads", std::size_t{0});
  rules.boundary = extension.value("boundary", std::string("edgeAndCorner")) == "edge"
                       ? subdivision::BoundaryRule::kEdge
                       : subdivision::BoundaryRule::kEdgeAndCorner;
  for_each_feature(extension, "creases", place,
                   [&](const json& entry, const Place&) { rules.creases.push_back(feature_of(entry)); });
  for_each_feature(extension, "corners", place,
                   [&](const json& entry, const Place&) { rules.corners.push_back(feature_of(entry)); });
  return rules;
}

}  // namespace

void check_subdivision(const json& d, const json& primitive, const Place& place) {
  const json* extension = subdivision_of(primitive);
  if (extension == nullptr) return;
  const Place inner = extension_place(place);
  if (primitive.value("mode", 4) != 4) inner.refuse("needs a cage of triangles (mode 4)");
  if (find_extension(primitive, "TESSERA_bezier_patches") != nullptr)
    inner.refuse("is on a primitive of Bezier patches");
  const json& attributes = primitive["attributes"];
  if (!attributes.contains("POSITION")) inner.refuse("needs POSITION");
  const auto accessor_count = [&](const json& index) {
    return d["accessors"][index.get<std::size_t>()]["count"].get<std::uint64_t>();
  };
  // The counts of a Draco stream are checked once it is decoded.
  if (find_extension(primitive, "KHR_draco_mesh_compression") != nullptr) return;
  const std::uint64_t vertices = accessor_count(attributes["POSITION"]);
  const std::uint64_t triangles = (primitive.contains("indices") ? accessor_count(primitive["indices"]) : vertices) / 3;
  const auto quads = extension->value("quads", std::uint64_t{0});
  if (quads > triangles / 2)
    inner.at("quads").refuse("is {}, the primitive's {} triangles make up to {}", quads, triangles, triangles / 2);
  for (const char* list : {"creases", "corners"})
    for_each_feature(*extension, list, inner, [&](const json& entry, const Place& entry_place) {
      for (std::size_t k = 0; k < entry["vertices"].size(); ++k)
        if (const auto vertex = entry["vertices"][k].get<std::uint64_t>(); vertex >= vertices)
          entry_place.at("vertices").at(k).refuse("is vertex {}, there are {}", vertex, vertices);
    });
}

void subdivide(Document& document, const json& json_primitive, const Place& place, Primitive& primitive) {
  const json* extension = subdivision_of(json_primitive);
  if (extension == nullptr) return;
  const Place inner = extension_place(place);
  try {
    primitive = subdivision::convert(primitive, rules_of(*extension, inner), document.budget, inner.pointer());
  } catch (const subdivision::CageError& error) {
    inner.refuse("{}", error.what());
  }
}

}  // namespace tessera::scene::gltf
