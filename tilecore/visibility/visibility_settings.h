#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::tilecore {

// Method by which a tile core finds the samples that a moving or defocused sub-patch may cover. All methods end in the
// same inside test and find the same hits with the same bits; they differ in the tests before it.
enum class VisibilityMethod : std::uint8_t {
  kPatchBvh,          // moving boxes of leaves and cells against the tile, then against samples
  kBrute,             // per cell, every sample of the rectangle of its whole motion
  kSegments,          // per cell, a rectangle for each of k segments of the shutter
  kPartition,         // per cell, the rectangle cut in space; for each part the times at which the cell is there
  kClusters,          // per leaf of 16 cells, a rectangle for each of k segments; its samples against all 16
  kClusterPartition,  // the same with the rectangle cut in space
  kInterleaved,       // per cell, a rectangle at each time that samples have
};

// Search of patch-bvh for samples.
enum class Traversal : std::uint8_t {
  kAuto,   // either, or brute, with the least expected work for the sub-patch (method_choice.h)
  kClass,  // by classes of samples
  kRay,    // one ray at a time from the branch node
};

// Start node of the rays of a rectangle in the tree.
enum class BranchNode {
  kRoot,
  kBothChildren,  // the first node with both children inside the frustum
  kLeafMask,      // the lowest node above all leaves inside the frustum at the current times
};

// Keys tilecore.visibility_method, .stencil_segments, .traversal, .branch_node.
struct VisibilityMethodSettings {
  // Distinct times of samples with kInterleaved, unless sampling.times sets them [assumed]: a small fixed number as in
  // US 8791945.
  static constexpr int kInterleavedTimes = 16;

  VisibilityMethod method = VisibilityMethod::kPatchBvh;
  int stencil_segments = 0;  // k; 0: by blur length over primitive size
  Traversal traversal = Traversal::kAuto;
  BranchNode branch_node = BranchNode::kLeafMask;

  // Classes of the sample pattern against moving boxes: the kernels of sample_tests.h, without the units below.
  bool by_class() const { return method == VisibilityMethod::kPatchBvh && traversal == Traversal::kClass; }
  bool chooses() const { return method == VisibilityMethod::kPatchBvh && traversal == Traversal::kAuto; }
};
Keys<VisibilityMethodSettings> visibility_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::VisibilityMethod> = std::to_array<std::string_view>(
    {"patch-bvh", "brute", "segments", "partition", "clusters", "cluster-partition", "interleaved"});
template <>
inline constexpr auto kEnumWords<tilecore::Traversal> = std::to_array<std::string_view>({"auto", "class", "ray"});
template <>
inline constexpr auto kEnumWords<tilecore::BranchNode> = std::to_array<std::string_view>({"root", "both_children",
                                                                                          "leaf_mask"});

}  // namespace tessera
