#include "scene/gltf/accessor_uses.h"

#include <string>

#include <nlohmann/json.hpp>

#include "scene/gltf/document.h"
#include "scene/gltf/json_reader.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;
using Visit = std::function<void(const AccessorUsed&, const Place&)>;

void visit_primitive(const json& d, const json& primitive, const Place& place, const Visit& visit) {
  const json* draco = find_extension(primitive, "KHR_draco_mesh_compression");
  const bool clusters = find_encoded_clusters(primitive) != nullptr;
  for (const auto& [name, index] : primitive["attributes"].items())
    visit({index.get<std::size_t>(),
           AccessorRole::kVertices,
           name,
           {},
           (draco != nullptr && (*draco)["attributes"].contains(name)) || (clusters && name == "POSITION")},
          place.at("attributes").at(name));
  if (const json* indices = find(primitive, "indices")) {
    const json* position = find(primitive["attributes"], "POSITION");
    visit({indices->get<std::size_t>(),
           AccessorRole::kIndices,
           {},
           {},
           draco != nullptr || clusters,
           position == nullptr ? std::size_t{0}
                               : d["accessors"][position->get<std::size_t>()]["count"].get<std::size_t>()},
          place.at("indices"));
  }
  const json& targets = list_of(primitive, "targets");
  for (std::size_t t = 0; t < targets.size(); ++t)
    for (const auto& [name, index] : targets[t].items())
      visit({index.get<std::size_t>(), AccessorRole::kTarget, name}, place.at("targets").at(t).at(name));
}

}  // namespace

void for_each_accessor_use(const json& document, const Place& root, const Visit& visit) {
  const json& meshes = list_of(document, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m)
    for (std::size_t p = 0; p < meshes[m]["primitives"].size(); ++p)
      visit_primitive(document, meshes[m]["primitives"][p], root.at("meshes").at(m).at("primitives").at(p), visit);
  const json& skins = list_of(document, "skins");
  for (std::size_t s = 0; s < skins.size(); ++s)
    if (const json* matrices = find(skins[s], "inverseBindMatrices"))
      visit({matrices->get<std::size_t>(), AccessorRole::kInverseBind},
            root.at("skins").at(s).at("inverseBindMatrices"));
  const json& nodes = list_of(document, "nodes");
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (const json* instancing = find_extension(nodes[n], "EXT_mesh_gpu_instancing"))
      for (const auto& [name, index] : (*instancing)["attributes"].items())
        visit({index.get<std::size_t>(), AccessorRole::kInstances, name},
              root.at("nodes").at(n).at("extensions").at("EXT_mesh_gpu_instancing").at("attributes").at(name));
  const json& animations = list_of(document, "animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const json& channels = animations[a]["channels"];
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const auto sampler = channels[c]["sampler"].get<std::size_t>();
      const json& s = animations[a]["samplers"][sampler];
      const Place place = root.at("animations").at(a).at("samplers").at(sampler);
      visit({s["input"].get<std::size_t>(), AccessorRole::kKeyTimes}, place.at("input"));
      visit({s["output"].get<std::size_t>(),
             AccessorRole::kKeyValues,
             {},
             channels[c]["target"]["path"].get_ref<const std::string&>()},
            place.at("output"));
    }
  }
}

}  // namespace tessera::scene::gltf
