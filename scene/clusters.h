#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

inline constexpr std::size_t kMaxClusterVertices = 64;  // [spec] NVIDIA and AMD mesh shaders, meshoptimizer's advice
inline constexpr std::size_t kMaxClusterTriangles = 124;
// Meshes with more triangles are cut into clusters range by range, on all threads.
inline constexpr std::size_t kClusterRangeTriangles = std::size_t{1} << 17;

// A cell is the content of a leaf of the tile core's tests: a quad of two triangles (a, b, c) and (a, c, d), or one
// triangle, where d == c.
struct ClusterCell {
  std::array<std::uint8_t, 4> corner;  // vertices of the cluster
  bool single() const { return corner[2] == corner[3]; }
};

struct Cluster {
  std::uint32_t first_vertex, vertex_count;  // in MeshClusters::vertices
  std::uint32_t first_cell, cell_count;      // in MeshClusters::cells
  std::uint32_t triangle_count;
};

// A passive mesh cut into clusters (meshoptimizer's meshlets); neighbouring triangles paired into cells.
struct MeshClusters {
  std::vector<std::uint32_t> vertices;  // index of the primitive's vertex
  std::vector<ClusterCell> cells;
  std::vector<Cluster> clusters;
};

// Clusters of a primitive's triangles. meshoptimizer finds them. Where the primitive says that its triangles are in
// cluster order, each cluster instead ends where the next triangle does not fit. Clusters that the file has encoded
// stay as they are.
//
// Invariants (cited by the tests):
//   CO1  Every triangle is in one cluster, once, with its winding; no cluster exceeds the limits above.
//   CO2  Cutting triangles in cluster_order() gives the clusters from which the order was made.
//   CO3  Cutting any triangles gives sound clusters, at most cluster_count_bound() of them.
MeshClusters build_clusters(const Primitive& primitive);

// The primitive's triangles, three indices each, cluster by cluster as build_clusters() finds them; ranges stay apart.
// A cluster's first triangle is one that did not fit into the previous cluster; the others are ordered for a vertex
// cache.
std::vector<std::uint32_t> cluster_order(const Primitive& primitive);

// The largest number of clusters that build_clusters() makes of so many indices.
std::size_t cluster_count_bound(std::size_t index_count);

using LocalTriangle = std::array<std::uint8_t, 3>;
// The quad of two triangles that share an edge, wind alike and have four vertices; nothing for other pairs.
std::optional<ClusterCell> join_triangles(const LocalTriangle& s, const LocalTriangle& t);
ClusterCell cell_alone(const LocalTriangle& triangle);

// Exposed for tests: cells of a cluster's triangles. Each triangle is paired with the next free neighbour; a triangle
// without a partner becomes a cell of its own.
void pair_triangles(std::span<const LocalTriangle> triangles, std::vector<ClusterCell>& cells);

}  // namespace tessera::scene
