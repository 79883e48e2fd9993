#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

struct MeshClusters;

// Boxes of neighbouring base patches of a primitive as it rests, a hierarchy over their order in memory: a box of the
// lowest level holds kPatchesPerGroup patches, one of a further level as many boxes of the level below. The last level
// has no more than that.
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
