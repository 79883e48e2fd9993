#include "scene/held_geometry.h"

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <utility>

#include "base/check.h"
#include "base/parallel.h"
#include "scene/assembly.h"
#include "scene/geometry_record.h"
#include "scene/limits.h"
#include "scene/position_lattice.h"

namespace tessera::scene {
namespace {

// Encodes records of one primitive, one after the other.
class RecordKeeper {
 public:
  RecordKeeper(const GeometrySettings& settings, const PositionLattice& lattice, const Primitive& primitive,
               HeldGeometry& held)
      : settings_(settings), lattice_(lattice), primitive_(primitive), held_(held) {
    held.positions = primitive.vertices.positions;
  }

  // `vertices`: numbers of the primitive's; they get the decoder's order. Returns the cells that it gives.
  std::vector<ClusterCell> keep(std::span<std::uint32_t> vertices, std::span<const ClusterCell> cells) {
    std::array<LatticePoint, kMaxClusterVertices> points;
    std::array<std::uint32_t, kMaxClusterVertices> before;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      points[v] = lattice_.place(primitive_.vertices.positions[vertices[v]]);
      before[v] = vertices[v];
    }
    const EncodedRecord record = encode_record(settings_, lattice_, std::span(points).first(vertices.size()), cells);
    DecodedRecord decoded = decode_record(settings_, record.bytes, vertices.size(), record.parts);
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      vertices[v] = before[record.order[v]];
      TESSERA_CHECK(decoded.positions[v] == lattice_.point(points[record.order[v]]),
                    "records decode to their positions");
      held_.positions[vertices[v]] = decoded.positions[v];
    }
    held_.record_bytes.push_back(static_cast<std::uint32_t>(record.bytes.size()));
    held_.record_elements.push_back(static_cast<std::uint16_t>(record.elements));
    return std::move(decoded.cells);
  }

 private:
  GeometrySettings settings_;
  const PositionLattice& lattice_;
  const Primitive& primitive_;
  HeldGeometry& held_;
};

// A primitive with the positions that bounds and neighbours follow from.
Primitive decoded_primitive(const Primitive& primitive, const std::vector<Vec3>& positions) {
  Primitive out;
  out.kind = primitive.kind;
  out.vertices.positions = positions;
  return out;
}

struct Task {
  const Primitive* primitive;
  const PositionLattice* lattice;
  std::uint32_t geometry;
};

void hold_clusters(const GeometrySettings& settings, const Task& task, Assembly& assembly) {
  MeshClusters& clusters = assembly.clusters[task.geometry];
  HeldGeometry& held = assembly.held_clusters[task.geometry];
  RecordKeeper keeper(settings, *task.lattice, *task.primitive, held);
  std::vector<ClusterCell> cells;
  for (Cluster& cluster : clusters.clusters) {
    const std::vector<ClusterCell> decoded =
        keeper.keep(std::span(clusters.vertices).subspan(cluster.first_vertex, cluster.vertex_count),
                    std::span(clusters.cells).subspan(cluster.first_cell, cluster.cell_count));
    cluster.first_cell = static_cast<std::uint32_t>(cells.size());
    cluster.cell_count = static_cast<std::uint32_t>(decoded.size());
    cells.insert(cells.end(), decoded.begin(), decoded.end());
  }
  clusters.cells = std::move(cells);
  const Primitive decoded = decoded_primitive(*task.primitive, held.positions);
  assembly.cluster_groups[task.geometry] = group_clusters(decoded, clusters);
  assembly.cluster_bounds[task.geometry] = bound_clusters(decoded, clusters);
}

void hold_bezier_patches(GeometrySettings settings, const Task& task, Assembly& assembly) {
  // Blocks hold triangles.
  if (settings.encoding == GeometryEncoding::kDgf) settings.encoding = GeometryEncoding::kMeshlet;
  HeldGeometry& held = assembly.held_bezier[task.geometry];
  RecordKeeper keeper(settings, *task.lattice, *task.primitive, held);
  for (std::uint32_t first = 0; first < task.primitive->vertices.count(); first += 16) {
    std::array<std::uint32_t, 16> vertices;
    for (std::uint32_t k = 0; k < 16; ++k) vertices[k] = first + k;
    keeper.keep(vertices, {});
  }
  const Primitive decoded = decoded_primitive(*task.primitive, held.positions);
  assembly.bezier_groups[task.geometry] = group_bezier_patches(decoded.vertices);
  assembly.neighbours[task.geometry] = find_neighbours(decoded.vertices);
}

}  // namespace

void hold_geometry(const GeometrySettings& settings, Assembly& assembly) {
  if (settings.raw()) return;
  const Capture& capture = *assembly.capture;
  const std::vector<PositionLattice> lattices = mesh_lattices(capture, settings);
  assembly.held_clusters.resize(assembly.clusters.size());
  assembly.held_bezier.resize(assembly.neighbours.size());
  const std::uint64_t charged = assembly.charged_bytes();
  MemoryBudget budget(capture.max_bytes, capture.file.string(), charged);
  std::vector<Task> clusters, bezier;
  std::set<std::pair<int, int>> seen;
  for (const Drawable& drawable : assembly.drawables) {
    if (drawable.kind == Primitive::Kind::kProcedure || !seen.emplace(drawable.mesh, drawable.primitive).second)
      continue;
    const auto mesh = static_cast<std::size_t>(drawable.mesh);
    const Primitive& primitive = capture.meshes[mesh].primitives[static_cast<std::size_t>(drawable.primitive)];
    if (!rests_always(primitive)) continue;
    budget.charge(primitive.vertices.count(), sizeof(Vec3), "positions that are decoded (geometry.encoding)");
    (drawable.kind == Primitive::Kind::kTriangles ? clusters : bezier)
        .push_back({&primitive, &lattices[mesh], drawable.geometry});
  }
  assembly.geometry_bytes = budget.used_bytes() - charged;
  parallel_for(clusters.size(), [&](std::size_t i) { hold_clusters(settings, clusters[i], assembly); });
  parallel_for(bezier.size(), [&](std::size_t i) { hold_bezier_patches(settings, bezier[i], assembly); });
}

}  // namespace tessera::scene
