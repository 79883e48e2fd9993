#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "scene/cluster_stream.h"
#include "scene/gltf/document.h"

namespace tessera::scene::gltf {

using nlohmann::json;

const json* find_encoded_clusters(const json& primitive) {
  const json* clusters = find_extension(primitive, "TESSERA_clusters");
  return clusters != nullptr && clusters->contains("encoding") ? clusters : nullptr;
}

DecodedMesh read_clusters(Document& document, const json& primitive, const Place& place) {
  const json& extension = *find_encoded_clusters(primitive);
  const Place at = place.at("extensions").at("TESSERA_clusters");
  const auto count = [&](const json& accessor) { return document.layouts[accessor.get<std::size_t>()].count; };
  ClusterStreamCounts counts;
  counts.clusters = extension["clusters"].get<std::size_t>();
  counts.vertices = count(primitive["attributes"]["POSITION"]);
  counts.triangles = count(primitive["indices"]) / 3;
  const Bytes bytes = document.resources.buffer_view(extension["bufferView"].get<std::size_t>());
  if (counts.clusters > bytes.size() / kClusterHeaderBytes)
    at.at("clusters").refuse("is {}, too many for {} bytes", counts.clusters, bytes.size());
  // Charges the decoded data, and the scalars and indices that are made from it.
  document.budget.charge(counts.vertices, 2 * sizeof(Vec3), at);
  document.budget.charge(counts.clusters, sizeof(Cluster), at);
  document.budget.charge(counts.triangles, 3 * sizeof(std::uint32_t) + 1, at);
  GeometrySettings settings;
  settings.encoding = from_word<GeometryEncoding>(extension["encoding"].get<std::string>()).value();
  settings.bits = extension["bits"].get<int>();
  std::string fault;
  std::optional<DecodedClusters> clusters = decode_cluster_stream(settings, bytes, counts, fault);
  if (!clusters) at.refuse("{}", fault);
  DecodedMesh out;
  out.indices = std::move(clusters->indices);
  out.vertex_count = counts.vertices;
  out.triangles_of_cluster = std::move(clusters->triangles_of_cluster);
  std::vector<float> scalars(3 * counts.vertices);
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  if (counts.vertices > 0) std::memcpy(scalars.data(), &clusters->positions.front().x, scalars.size() * sizeof(float));
  out.attributes.emplace_back("POSITION", std::move(scalars));
  return out;
}

}  // namespace tessera::scene::gltf
