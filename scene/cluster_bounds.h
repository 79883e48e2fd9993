#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/capture.h"

namespace tessera::scene {

struct MeshClusters;

// Bounds of a cluster's vertices and triangles in the rest pose, in object space. They are made once, so that a front
// end can bound and cull the cluster without reading its vertices or triangles.
//
// Invariants (cited by the tests):
//   CB1  Both boxes hold every vertex: axis a of frame() times a vertex lies in [low[a], high[a]].
//   CB2  A turned box has less surface than the aligned one; else both are the same.
//   CB3  Every triangle but those with two corners in one place has a normal within the cone; with N the cross product
//        of two of its edges and S the sum of its two longest, |N| / S is at least least_height, and S at least
//        least_edges.
struct ClusterBound {
  std::array<std::int16_t, 4> rotation{0, 0, 0,
                                       32767};  // x y z w of a quaternion of any length: object axes to frame()
  std::array<float, 3> low{}, high{};
  // Box along the object's axes. Boxes of groups and instances contain it, while corners of a turned box may stick out
  // of them.
  std::array<float, 3> aligned_low{}, aligned_high{};
  std::array<float, 3> cone_axis{};  // about of length 1
  float cone_cosine = 0;             // of the half angle about the axis, rounded down; 0: no cone
  float least_height = 0, least_edges = 0;

  bool turned() const { return rotation != ClusterBound{}.rotation; }
  // Axes of the turned box, orthonormal to double precision; exactly the object's axes where the box is aligned with
  // them.
  std::array<DVec3, 3> frame() const;
};

// Returns a bound for each cluster.
std::vector<ClusterBound> bound_clusters(const Primitive& primitive, const MeshClusters& clusters);

struct MeshClusters;

// Boxes of neighbouring base patches of a primitive in the rest pose, a hierarchy over their order in memory: a box of
// the lowest level holds kPatchesPerGroup patches, and a box of a higher level holds kPatchesPerGroup boxes of the
// level below. The last level has at most kPatchesPerGroup boxes.
//
// Invariant (cited by the tests):
//   PG1  A box holds every control point, or every vertex, of its patches.
inline constexpr std::uint32_t kPatchesPerGroup = 16;  // [assumed] boxes that lie together and are tested at once

struct PatchGroups {
  struct Box {
    std::array<float, 3> low, high;  // object space
  };
  // Box i of level k: patches [i * 16^(k+1), (i + 1) * 16^(k+1)). Empty for a primitive of a single group.
  std::vector<std::vector<Box>> levels;

  std::size_t box_count() const;
};

PatchGroups group_clusters(const Primitive& primitive, const MeshClusters& clusters);
PatchGroups group_bezier_patches(const Vertices& control_points);

}  // namespace tessera::scene
