#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/counter.h"
#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/bundle_frustum.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

struct RayCounters {
  std::uint64_t frustum_node_tests = 0;
  std::uint64_t node_visits = 0;
  std::uint64_t rays_cast = 0;
  std::uint64_t rays_hit = 0;
};

// Motion BVH of one sub-patch (Clarberg and Burns, US 8791945): a binary tree over its cells whose shape follows from
// the tessellation pattern, so that nothing is sorted. Built in on-chip scratch memory right before a tile uses it.
//
//   leaves of 4x4 cells on their grid, in Morton order    ->  heap: node 1 is the root, 2n and 2n+1 the children of n,
//   inside a leaf: the cells of a full one in Morton order    cells the nodes of the last level; absent ones are empty
//
// Deviations: the published traversal casts rays from 4x4-pixel tiles only; here the tile core's tile comes first, and
// the traversals of the rectangles inside it begin at its branch node. And the leaves' times may be used for several
// intervals: each part of a cut shutter has its own leaf mask, and so its own branch node.
//
// Invariants (cited by the tests):
//   BVH1  A node's box holds its children's at both motion keys, hence at every time.
//   BVH2  Every sample that the inside test finds in a cell reaches that cell's node by trace(), from the root and from
//         the branch node of every rectangle that holds the sample: no leaf that a ray hits is outside the branch node.
//   BVH3  The leaf-mask branch node is at or below the both-children branch node.
//   BVH4  BVH2 holds for within(values) and samples of those stencil values.
class MotionBvh {
 public:
  // `leaf_columns`: leaves in a row of the sub-patch's grid; the number of leaves for lists of cells. Clipped cells are
  // left out. Boxes include the rounding of the inside test (see the source for the widths). Returns the number of
  // boxes built.
  std::uint64_t build(const MicroMesh& mesh, std::size_t leaf_columns, RayEffects effects, const RaySpace& space);

  static constexpr std::uint32_t kRoot = 1;
  std::uint32_t leaf_count() const { return leaf_count_; }  // a power of two, with empty leaves
  std::uint32_t first_leaf() const { return leaf_count_; }  // number of the first node of the last level
  std::uint32_t cell_of(std::uint32_t leaf_node) const { return cells_[leaf_node - leaf_count_]; }
  const MotionBox& node(std::uint32_t n) const { return nodes_[n]; }

  // The leaves that a frustum meets at or below a node.
  struct Overlap {
    bool any = false;
    TimeRange stencils{255, 0};    // hull of the times of the leaves inside, as stencil values
    std::uint32_t branch = kRoot;  // start node of rays: the node itself or one below it
  };
  Overlap traverse(const BundleFrustum& frustum, std::uint32_t start, BranchNode method);
  // The part of the last traverse()'s result that is inside at samples of some stencil values.
  Overlap within(const TimeRange& values);

  // A sample's ray o + z d against slabs: z = A x(0) + B x(1) + C with A = (1-t)/d, B = t/d, C = -o/d per axis.
  struct Ray {
    std::array<double, 2> a, b, c;
    double t;
    double limit;  // depth beyond which hits do not matter to the sample
    std::uint32_t sample;
  };
  Ray ray(const TileSamples& samples, std::uint32_t sample, float limit) const;

  // Samples whose rays meet a cell's box, in the order of the rays.
  struct CellRays {
    std::uint32_t cell;
    std::span<const std::uint32_t> samples;
  };
  // Traces each ray from `start`; a node that begins behind a ray's limit is not entered. Rays are traced side by side,
  // node by node: each visits exactly the nodes that it would visit alone. `visit(const CellRays&)` is called per leaf.
  template <class Visit>
  void trace(std::span<const Ray> rays, std::uint32_t start, const Visit& visit);

  RayCounters& counters() { return counters_; }
  RayCounters take_counters();

 private:
  // Collects the leaves inside the frustum under `node`, which is inside itself.
  void traverse_inside(const BundleFrustum& frustum, std::uint32_t node);
  bool test_node(const BundleFrustum& frustum, std::uint32_t node);
  std::uint32_t branch_of_mask();  // reduces mask_
  bool meets(const Ray& ray, const MotionBox& box) const;
  // Collects the numbers of the rays of alive_[level - 1] that meet the node in alive_[level].
  bool visit_node(std::span<const Ray> rays, std::uint32_t node, std::size_t level);
  template <class Visit>
  void trace_below(std::span<const Ray> rays, std::uint32_t node, std::size_t level, const Visit& visit);

  RaySpace space_;
  std::uint32_t leaf_count_ = 0;
  std::vector<MotionBox> nodes_;
  std::vector<std::uint32_t> cells_;
  struct LeafInside {
    std::uint32_t leaf;
    TimeRange stencils;
  };
  std::vector<LeafInside> inside_;                 // of the last frustum
  BranchNode method_ = BranchNode::kRoot;          // of the last traversal
  std::uint32_t start_ = kRoot, fork_ = 0;         // its start, and its first node with both children inside
  std::vector<std::uint64_t> mask_;                // leaves inside at some times, one bit each
  std::vector<std::vector<std::uint32_t>> alive_;  // per level of the traversal
  std::vector<std::uint32_t> leaf_samples_;
  RayCounters counters_;
};

template <class Visit>
void MotionBvh::trace(std::span<const Ray> rays, std::uint32_t start, const Visit& visit) {
  alive_[0].resize(rays.size());
  for (std::uint32_t k = 0; k < rays.size(); ++k) alive_[0][k] = k;
  trace_below(rays, start, 1, visit);
}

template <class Visit>
void MotionBvh::trace_below(std::span<const Ray> rays, std::uint32_t node, std::size_t level, const Visit& visit) {
  if (!visit_node(rays, node, level)) return;
  if (node < leaf_count_) {
    trace_below(rays, 2 * node, level + 1, visit);
    trace_below(rays, 2 * node + 1, level + 1, visit);
    return;
  }
  leaf_samples_.clear();
  for (const std::uint32_t k : alive_[level]) leaf_samples_.push_back(rays[k].sample);
  visit(CellRays{cell_of(node), leaf_samples_});
}

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::RayCounters> = std::to_array<CounterField<tilecore::RayCounters>>({
    {"tilecore.frustum_node_tests", &tilecore::RayCounters::frustum_node_tests, Combine::kSum, "tests",
     "Nodes of motion BVHs that were tested against the frustum of a tile or of a part of it.", ""},
    {"tilecore.node_visits", &tilecore::RayCounters::node_visits, Combine::kSum, "tests",
     "Nodes of motion BVHs that were tested against single rays.", "MaliRTUBox"},
    {"tilecore.rays_cast", &tilecore::RayCounters::rays_cast, Combine::kSum, "rays",
     "Samples that were traced as rays through the motion BVH of a sub-patch.", "MaliRTURay"},
    {"tilecore.rays_hit", &tilecore::RayCounters::rays_hit, Combine::kSum, "rays",
     "Rays that hit a triangle of the sub-patch, hidden or not. Over rays_cast: the ray hit rate.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::RayCounters);
template <>
inline constexpr bool kAbsentWhenIdle<tilecore::RayCounters> = true;

}  // namespace tessera
