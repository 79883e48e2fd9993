#include "scene/clusters.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <meshoptimizer.h>

#include "base/parallel.h"

namespace tessera::scene {
namespace {

constexpr std::size_t kRangeIndices = 3 * kClusterRangeTriangles;
constexpr std::uint8_t kNoNumber = 0xFF;

std::size_t range_count(std::size_t indices) { return (indices + kRangeIndices - 1) / kRangeIndices; }

std::span<const std::uint32_t> range_of(std::span<const std::uint32_t> indices, std::size_t range) {
  const std::size_t first = range * kRangeIndices;
  return indices.subspan(first, std::min(kRangeIndices, indices.size() - first));
}

// ---- Cells ------------------------------------------------------------------------------------------------------

// Triangles by the directed edges that they wind along.
class EdgeOwners {
 public:
  // Returns false where two triangles have the same edge, so that the edge does not identify its triangle.
  bool add(std::span<const LocalTriangle> triangles) {
    owner_.fill(kNoNumber);
    bool unique = true;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint8_t& slot = at(triangles[t][k], triangles[t][(k + 1) % 3]);
        unique &= slot == kNoNumber;
        slot = static_cast<std::uint8_t>(t);
      }
    return unique;
  }
  std::uint8_t of(std::uint8_t from, std::uint8_t to) { return at(from, to); }

 private:
  std::uint8_t& at(std::uint8_t from, std::uint8_t to) { return owner_[from * kMaxClusterVertices + to]; }
  std::array<std::uint8_t, kMaxClusterVertices * kMaxClusterVertices> owner_;
};

// Pairs triangles by comparing each one with all later ones.
void pair_each_with_all(std::span<const LocalTriangle> triangles, std::vector<ClusterCell>& cells) {
  std::array<bool, kMaxClusterTriangles> used{};
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    if (used[s]) continue;
    std::optional<ClusterCell> cell;
    for (std::size_t t = s + 1; t < triangles.size() && !cell; ++t) {
      if (used[t]) continue;
      cell = join_triangles(triangles[s], triangles[t]);
      if (cell) used[t] = true;
    }
    cells.push_back(cell.value_or(cell_alone(triangles[s])));
  }
}

// ---- Finding and cutting ----------------------------------------------------------------------------------------

// meshoptimizer squares coordinates. Returns `positions` where the squares are finite; else fills `smaller` with the positions
// over a power of two and returns those.
const Vec3* squarable(std::span<const Vec3> positions, std::vector<Vec3>& smaller) {
  constexpr float kLargest = 0x1p48f;
  float largest = 0;
  for (const Vec3& p : positions)
    for (int c = 0; c < 3; ++c)
      if (std::isfinite(p[c])) largest = std::max(largest, std::abs(p[c]));
  if (largest <= kLargest) return positions.data();
  const int exponent = std::ilogb(largest);
  for (const Vec3& p : positions)
    smaller.emplace_back(std::ldexp(p.x, -exponent), std::ldexp(p.y, -exponent), std::ldexp(p.z, -exponent));
  return smaller.data();
}

// Calls add(vertices, triangles) for each cluster that meshoptimizer finds in some of a primitive's triangles.
template <class Add>
void find_clusters(const Primitive& primitive, std::span<const std::uint32_t> indices, const Add& add) {
  // Only the vertices between the first and the last that they use.
  const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
  const std::uint32_t base = *low;
  const std::size_t vertex_count = *high - base + 1;
  std::vector<std::uint32_t> near(indices.begin(), indices.end());
  for (std::uint32_t& index : near) index -= base;
  const std::size_t capacity = meshopt_buildMeshletsBound(near.size(), kMaxClusterVertices, kMaxClusterTriangles);
  std::vector<meshopt_Meshlet> meshlets(capacity);
  std::vector<unsigned int> vertices(capacity * kMaxClusterVertices);
  std::vector<unsigned char> triangles(capacity * kMaxClusterTriangles * 3);
  std::vector<Vec3> smaller;
  const Vec3* const positions = squarable(std::span(primitive.vertices.positions).subspan(base, vertex_count), smaller);
  const std::size_t count =
      meshopt_buildMeshlets(meshlets.data(), vertices.data(), triangles.data(), near.data(), near.size(), &positions->x,
                            vertex_count, sizeof(Vec3), kMaxClusterVertices, kMaxClusterTriangles, 0.0f);
  std::array<LocalTriangle, kMaxClusterTriangles> local;
  for (std::size_t m = 0; m < count; ++m) {
    const meshopt_Meshlet& meshlet = meshlets[m];
    const std::span<unsigned int> used(&vertices[meshlet.vertex_offset], meshlet.vertex_count);
    for (unsigned int& vertex : used) vertex += base;
    std::memcpy(local.data(), &triangles[meshlet.triangle_offset], 3 * std::size_t{meshlet.triangle_count});
    add(used, std::span(local).first(meshlet.triangle_count));
  }
}

// The same for clusters that are cut off in sequence. Vertices are counted as meshoptimizer counts them: a corner that
// a triangle has twice is two vertices.
// Where `sizes` is not empty, it states the triangles of each cluster instead; none may have too many vertices.
template <class Add>
void cut_clusters(std::span<const std::uint32_t> indices, std::span<const std::uint8_t> sizes, const Add& add) {
  const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
  const std::uint32_t base = *low;
  std::vector<std::uint8_t> number(*high - base + 1, kNoNumber);  // within the cluster, by vertex
  std::array<std::uint32_t, kMaxClusterVertices> vertices;
  std::array<LocalTriangle, kMaxClusterTriangles> triangles;
  std::size_t vertex_count = 0, triangle_count = 0, cluster = 0;
  const auto finish = [&] {
    add(std::span<const std::uint32_t>(vertices).first(vertex_count),
        std::span<const LocalTriangle>(triangles).first(triangle_count));
    for (std::size_t v = 0; v < vertex_count; ++v) number[vertices[v] - base] = kNoNumber;
    vertex_count = triangle_count = 0;
    ++cluster;
  };
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    std::size_t fresh = 0;
    for (std::size_t k = 0; k < 3; ++k) fresh += number[indices[i + k] - base] == kNoNumber ? 1 : 0;
    if (sizes.empty() ? vertex_count + fresh > kMaxClusterVertices || triangle_count == kMaxClusterTriangles
                      : triangle_count == sizes[cluster])
      finish();
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint8_t& local = number[indices[i + k] - base];
      if (local == kNoNumber) {
        local = static_cast<std::uint8_t>(vertex_count);
        vertices[vertex_count++] = indices[i + k];
      }
      triangles[triangle_count][k] = local;
    }
    ++triangle_count;
  }
  finish();
}

void add_cluster(std::span<const std::uint32_t> vertices, std::span<const LocalTriangle> triangles, MeshClusters& out) {
  Cluster cluster{};
  cluster.first_vertex = static_cast<std::uint32_t>(out.vertices.size());
  cluster.vertex_count = static_cast<std::uint32_t>(vertices.size());
  cluster.first_cell = static_cast<std::uint32_t>(out.cells.size());
  cluster.triangle_count = static_cast<std::uint32_t>(triangles.size());
  out.vertices.insert(out.vertices.end(), vertices.begin(), vertices.end());
  pair_triangles(triangles, out.cells);
  cluster.cell_count = static_cast<std::uint32_t>(out.cells.size()) - cluster.first_cell;
  out.clusters.push_back(cluster);
}

void append_clusters(const MeshClusters& part, MeshClusters& to) {
  const auto vertices = static_cast<std::uint32_t>(to.vertices.size()),
             cells = static_cast<std::uint32_t>(to.cells.size());
  to.vertices.insert(to.vertices.end(), part.vertices.begin(), part.vertices.end());
  to.cells.insert(to.cells.end(), part.cells.begin(), part.cells.end());
  for (Cluster cluster : part.clusters) {
    cluster.first_vertex += vertices;
    cluster.first_cell += cells;
    to.clusters.push_back(cluster);
  }
}

// ---- Order ------------------------------------------------------------------------------------------------------

// Triangles but for the first in the order of vertex caches; as indices of the primitive.
void append_ordered(std::span<const std::uint32_t> vertices, std::span<const LocalTriangle> triangles,
                    std::vector<std::uint32_t>& out) {
  std::vector<unsigned int> corners, ordered;
  for (const LocalTriangle& t : triangles) corners.insert(corners.end(), t.begin(), t.end());
  ordered = corners;
  if (triangles.size() > 1)
    meshopt_optimizeVertexCacheStrip(&ordered[3], &corners[3], corners.size() - 3, vertices.size());
  for (const unsigned int corner : ordered) out.push_back(vertices[corner]);
}

// How many triangles each cluster has.
using Sizes = std::vector<std::size_t>;

std::vector<std::uint32_t> range_order(const Primitive& primitive, std::span<const std::uint32_t> indices) {
  std::vector<std::uint32_t> ordered, found;
  Sizes sizes, cut;
  find_clusters(primitive, indices, [&](const auto& vertices, std::span<const LocalTriangle> triangles) {
    append_ordered(vertices, triangles, ordered);
    for (const LocalTriangle& t : triangles)
      for (const std::uint8_t corner : t) found.push_back(vertices[corner]);
    sizes.push_back(triangles.size());
  });
  // Corners that come twice in a triangle count by when they come: the order in which they were found always fits.
  cut_clusters(ordered, {}, [&](const auto&, const auto& triangles) { cut.push_back(triangles.size()); });
  return cut == sizes ? ordered : found;
}

}  // namespace

std::optional<ClusterCell> join_triangles(const LocalTriangle& s, const LocalTriangle& t) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      // The shared edge runs c->a in s = (a, b, c) and a->c in t = (a, c, d).
      const std::uint8_t a = s[i], b = s[(i + 1) % 3], c = s[(i + 2) % 3];
      if (t[j] == a && t[(j + 1) % 3] == c && t[(j + 2) % 3] != b) return ClusterCell{{a, b, c, t[(j + 2) % 3]}};
    }
  return std::nullopt;
}

ClusterCell cell_alone(const LocalTriangle& triangle) { return {{triangle[0], triangle[1], triangle[2], triangle[2]}}; }

void pair_triangles(std::span<const LocalTriangle> triangles, std::vector<ClusterCell>& cells) {
  EdgeOwners owners;
  if (!owners.add(triangles)) return pair_each_with_all(triangles, cells);
  std::array<bool, kMaxClusterTriangles> used{};
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    if (used[s]) continue;
    const LocalTriangle& first = triangles[s];
    std::size_t next = kNoNumber;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t t = owners.of(first[i], first[(i + 2) % 3]);
      if (t > s && t < next && !used[t] && join_triangles(first, triangles[t])) next = t;
    }
    if (next == kNoNumber) {
      cells.push_back(cell_alone(first));
    } else {
      used[next] = true;
      cells.push_back(*join_triangles(first, triangles[next]));
    }
  }
}

MeshClusters build_clusters(const Primitive& primitive) {
  if (!primitive.triangles_of_cluster.empty()) {
    MeshClusters out;
    cut_clusters(primitive.indices, primitive.triangles_of_cluster,
                 [&](const auto& vertices, const auto& triangles) { add_cluster(vertices, triangles, out); });
    return out;
  }
  // Ranges of their own, so that large meshes are cut on all threads.
  const std::size_t count = range_count(primitive.indices.size());
  if (count == 0) return {};
  std::vector<MeshClusters> parts(count);
  parallel_for(count, [&](std::size_t r) {
    const std::span<const std::uint32_t> indices = range_of(primitive.indices, r);
    const auto add = [&](const auto& vertices, const auto& triangles) { add_cluster(vertices, triangles, parts[r]); };
    if (primitive.in_cluster_order)
      cut_clusters(indices, {}, add);
    else
      find_clusters(primitive, indices, add);
  });
  MeshClusters out = std::move(parts.front());
  for (std::size_t r = 1; r < count; ++r) append_clusters(std::exchange(parts[r], {}), out);
  return out;
}

std::vector<std::uint32_t> cluster_order(const Primitive& primitive) {
  std::vector<std::vector<std::uint32_t>> parts(range_count(primitive.indices.size()));
  parallel_for(parts.size(), [&](std::size_t r) { parts[r] = range_order(primitive, range_of(primitive.indices, r)); });
  std::vector<std::uint32_t> out;
  out.reserve(primitive.indices.size());
  for (const std::vector<std::uint32_t>& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

std::size_t cluster_count_bound(std::size_t index_count) {
  const auto bound = [](std::size_t indices) {
    return indices == 0 ? 0 : meshopt_buildMeshletsBound(indices, kMaxClusterVertices, kMaxClusterTriangles);
  };
  return index_count / kRangeIndices * bound(kRangeIndices) + bound(index_count % kRangeIndices);
}

}  // namespace tessera::scene
