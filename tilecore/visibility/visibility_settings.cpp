#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

Keys<VisibilityMethodSettings> visibility_keys() {
  return {
      {"tilecore.visibility_method", &VisibilityMethodSettings::method,
       "Method by which a tile core finds the samples of a moving or defocused sub-patch: its motion BVH; the "
       "rectangle of each cell's whole motion; a stencil test on time for segments of the shutter, for parts of the "
       "rectangle, or for either of whole leaves; a rectangle at each of the few times that samples then have. The "
       "image is the same for all but the last, which shows objects at just these times.",
       "[spec] patch-bvh: US 8791945; segments, partition, clusters, cluster-partition: US 9626762; brute and "
       "interleaved: the references of both"},
      {"tilecore.stencil_segments", &VisibilityMethodSettings::stencil_segments, "segments", 0, 256,
       "Segments of the shutter of the methods segments and clusters; 0: the primitive's motion in units of its own "
       "size, at most 64.",
       "[spec] US 9626762 leaves the number open; [assumed] 0"},
      {"tilecore.traversal", &VisibilityMethodSettings::traversal,
       "Search of patch-bvh for samples: per class of the sample pattern (samples of one time, on a grid) from the "
       "moving box of a leaf, or each as a ray through the binary tree of the sub-patch's cells; auto: for each "
       "sub-patch one of these, or brute, with the least expected work: boxes built, tests of boxes and of triangles.",
       "[spec] ray: US 8791945; [assumed] class, auto"},
      {"tilecore.branch_node", &VisibilityMethodSettings::branch_node,
       "With rays (tilecore.traversal): start node of the rays of 4x4 pixels: the root; the first node with both "
       "children inside their frustum; the lowest node above all leaves inside.",
       "[spec] US 8791945 offers both; [measured] docs/visibility.md: leaf_mask"},
  };
}

}  // namespace tessera::tilecore
