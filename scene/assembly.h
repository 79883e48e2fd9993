#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// Patch assembly: cuts every primitive that is drawn into base patches, the unit that the machine bounds, bins and
// tessellates. A base patch is one bicubic Bezier patch, or one cluster of a passive mesh. Done once per capture.

inline constexpr std::size_t kMaxClusterVertices = 64;  // [spec] NVIDIA and AMD mesh shaders, meshoptimizer's advice
inline constexpr std::size_t kMaxClusterTriangles = 124;

// A cell is what a leaf of the tile core's tests holds: a quad of two triangles (a, b, c) and (a, c, d), or one
// triangle, then d == c.
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

// Neighbourhood of a Bezier patch. Vertices on a shared edge or corner are computed by one of the patches that share
// it, its owner, so that all of them get the same bits: no crack opens, displaced or not.
// Edges: 0 is v=0, 1 is v=1 (both along u), 2 is u=0, 3 is u=1 (both along v). Corners: 0 (0,0), 1 (1,0), 2 (0,1),
// 3 (1,1).
struct PatchNeighbours {
  struct EdgeOwner {
    std::uint32_t patch;  // within the primitive
    std::uint8_t edge;    // of the owner
    bool reversed;        // the owner's edge runs the other way
    bool collapsed;       // all four control points coincide: every vertex is the corner
  };
  struct CornerOwner {
    std::uint32_t patch;
    std::uint8_t corner;
  };
  std::array<EdgeOwner, 4> edges;
  std::array<CornerOwner, 4> corners;
};

// One primitive of one node.
struct Drawable {
  int node, mesh, primitive;  // mesh and primitive are kNone for a procedure
  int material;               // of Assembly::materials
  Primitive::Kind kind;
  std::uint32_t first_patch, patch_count;  // base patch numbers of the whole capture
  std::uint32_t geometry;  // index into Assembly::clusters, Assembly::neighbours or Capture::procedures, by kind
};

struct Assembly {
  const Capture* capture = nullptr;
  // The capture's, then one for primitives without, then those that primitives of the capture's need otherwise.
  std::vector<Material> materials;
  std::vector<int> material_source;                      // of each, the capture's that it comes from, or kNone
  std::vector<MeshClusters> clusters;                    // shared by all nodes that draw the mesh
  std::vector<std::vector<PatchNeighbours>> neighbours;  // per Bezier primitive and patch
  std::vector<Drawable> drawables;
  std::vector<std::uint32_t> patch_drawable;  // per base patch: its drawable

  std::size_t patch_count() const { return patch_drawable.size(); }
};

// Whether a drawable's patches are tessellated on parametric grids; clusters are not.
inline bool has_grid(const Drawable& drawable) { return drawable.kind != Primitive::Kind::kTriangles; }

// `capture` must outlive the assembly.
Assembly assemble(const Capture& capture);

// Exposed for tests.
MeshClusters build_clusters(const Primitive& primitive);
std::vector<PatchNeighbours> find_neighbours(const Vertices& control_points);

}  // namespace tessera::scene
