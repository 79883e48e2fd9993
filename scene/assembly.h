#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/capture.h"
#include "scene/cluster_bounds.h"
#include "scene/clusters.h"
#include "scene/held_geometry.h"

namespace tessera::scene {

// Patch assembly: cuts every drawn primitive into base patches, the unit that the machine bounds, bins and tessellates.
// A base patch is one bicubic Bezier patch, or one cluster of a passive mesh. Done once per capture.

// Neighbourhood of a Bezier patch. One of the patches that share an edge or corner, its owner, computes the vertices
// there, so that all of them get the same bits: no crack opens, displaced or not.
// Edges: 0 is v=0, 1 is v=1 (both along u), 2 is u=0, 3 is u=1 (both along v). Corners: 0 (0,0), 1 (1,0), 2 (0,1), 3
// (1,1).
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

// One primitive of one node or, where the node has instances, of one of its instances.
struct Drawable {
  int node, mesh, primitive;  // mesh and primitive are kNone for a procedure
  int material;               // index into Assembly::materials
  Primitive::Kind kind;
  bool instanced;                          // its node has instances, and no points or lines
  bool wire;                               // points or lines
  std::uint32_t first_patch, patch_count;  // base patch numbers of the whole capture
  std::uint32_t geometry;      // index into Assembly::clusters, Assembly::neighbours or Capture::procedures, by kind
  std::uint32_t instance;      // index into Node::instances; 0 without instances
  std::uint32_t drawn;         // index into Assembly::drawn
  std::uint32_t first_record;  // number of its first patch's record in memory; instances share records
  std::uint32_t first_grid;    // index of its first patch in Assembly::grid_patches, if its patches have grids
};

// Data that the instances of one primitive of one node have in common: everything but a transform. A primitive without
// instances has one drawable.
struct DrawnPrimitive {
  std::uint32_t first_drawable, stride, count;  // drawables first, first + stride, ...

  std::uint32_t drawable(std::uint32_t instance) const { return first_drawable + stride * instance; }
};

// Instances of a node that lie near each other. Each maps a point p of the mesh to origin + linear * p, with all
// numbers in these ranges (rounded outwards), so that one box holds all the instances, however the mesh deforms.
struct InstanceGroup {
  std::uint32_t first, count;  // in InstancedNode::order
  std::array<float, 3> origin_low, origin_high;
  std::array<std::array<float, 3>, 3> linear_low, linear_high;  // [row][column]
};

// A node with instances, surfaces only. Instance i of its primitive p has the drawable first_drawable + i * primitives
// + p.
struct InstancedNode {
  int node;
  std::uint32_t first_drawable, primitives, first_drawn;
  std::vector<std::uint32_t> order;  // the instances along a space-filling curve
  std::vector<InstanceGroup> groups;
};
inline constexpr std::size_t kInstancesPerGroup = 64;  // [assumed] as many as lanes of a wide SIMD unit test at once

struct Assembly {
  const Capture* capture = nullptr;
  // The capture's materials, then one for primitives without a material, then variants of these that some primitives
  // need.
  std::vector<Material> materials;
  std::vector<int> material_source;    // per material: number of the capture's material that it comes from, or kNone
  std::vector<MeshClusters> clusters;  // shared by all nodes that draw the mesh
  std::vector<std::vector<PatchNeighbours>> neighbours;    // per Bezier primitive and patch
  std::vector<PatchGroups> cluster_groups, bezier_groups;  // in the order of `clusters` and of `neighbours`
  // In the order of `clusters`, then one per cluster of the primitive; none for primitives whose vertices may move.
  std::vector<std::vector<ClusterBound>> cluster_bounds;
  // In the order of `clusters` and of `neighbours` where the memory holds encoded geometry; else empty.
  std::vector<HeldGeometry> held_clusters, held_bezier;
  std::vector<Drawable> drawables;
  std::vector<DrawnPrimitive> drawn;
  std::vector<InstancedNode> instanced_nodes;
  std::vector<std::uint32_t> patch_drawable;  // per base patch: its drawable
  std::vector<std::uint32_t> grid_patches;    // base patches that have grids, in order
  std::uint32_t record_count = 0;             // base patches in memory: instances of one patch share a record
  std::uint64_t texture_bytes = 0;            // HeldTextures::charged_bytes of the textures in `materials`
  std::uint64_t geometry_bytes = 0;           // bytes of the decoded positions

  std::size_t patch_count() const { return patch_drawable.size(); }
  // Bytes of Capture::max_bytes that are charged before any frame.
  std::uint64_t charged_bytes() const {
    return std::min(capture->charged_bytes + texture_bytes + geometry_bytes, capture->max_bytes);
  }
  const Drawable& drawable_of(std::uint32_t patch) const { return drawables[patch_drawable[patch]]; }
  // Returns nullptr where the memory holds the capture's floats.
  const HeldGeometry* held_geometry(const Drawable& drawable) const {
    if (drawable.kind == Primitive::Kind::kProcedure) return nullptr;
    const std::vector<HeldGeometry>& held = drawable.kind == Primitive::Kind::kTriangles ? held_clusters : held_bezier;
    return held.empty() || held[drawable.geometry].raw() ? nullptr : &held[drawable.geometry];
  }
  std::uint32_t record_of(std::uint32_t patch) const {
    const Drawable& drawable = drawable_of(patch);
    return drawable.first_record + (patch - drawable.first_patch);
  }
};

// Whether a drawable's patches are tessellated on parametric grids; clusters are not.
inline bool has_grid(const Drawable& drawable) { return drawable.kind != Primitive::Kind::kTriangles; }

// Whether a primitive of a node is drawn (kNone stands for the node's procedure). An empty filter draws all.
using DrawnFilter = std::function<bool(int node, int primitive)>;

// `capture` must outlive the assembly. Throws LimitError where base patches cannot be numbered with 32 bits.
//
// Invariants (cited by the tests):
//   AS1  Instances are numbered like separate nodes in their place: instance by instance, primitive by primitive.
//   AS2  Instances of a primitive share clusters, neighbours and records; a further instance costs a drawable and four
//        bytes for each base patch (and for its grid).
//   AS3  Each instance is in one group of its node, and the ranges of the group hold its transform.
Assembly assemble(const Capture& capture, const DrawnFilter& drawn = {});

// Exposed for the tests.
InstancedNode group_instances(const std::vector<InstanceTransform>& instances);
std::vector<PatchNeighbours> find_neighbours(const Vertices& control_points);

}  // namespace tessera::scene
