#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hardware/configuration.h"
#include "tilecore/visibility/bounding_polygons.h"
#include "tilecore/visibility/motion_bvh.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/stencil.h"

namespace tessera::tilecore {

// How a tile core finds which samples a moving or defocused sub-patch may cover. All methods end in the same inside
// test and find the same hits with the same bits; they differ in what they test for them.
enum class VisibilityMethod {
  kPatchBvh,     // moving boxes of leaves and cells against the tile, then against samples
  kBrute,        // per cell, every sample of the rectangle of its whole motion
  kSegments,     // per cell, a rectangle for each of k segments of the shutter
  kPartition,    // per cell, the rectangle cut in space; for each part the times at which the cell is there
  kClusters,     // per leaf of 16 cells, a rectangle for each of k segments; its samples against all 16
  kInterleaved,  // per cell, a rectangle for each of N fixed intervals
};

struct VisibilityMethodSettings {
  VisibilityMethod method = VisibilityMethod::kPatchBvh;
  int stencil_segments = 0;    // k; 0: by blur length over primitive size
  int interleaved_times = 16;  // N
  bool single_rays = false;    // patch-bvh: one ray at a time from the branch node, instead of by classes of samples
  BranchNode branch_node = BranchNode::kLeafMask;
  int ray_segments = 1;  // parts of the shutter that have branch nodes of their own

  // Classes of the sample pattern against moving boxes: the kernels of visibility_kernel.h, without the units below.
  bool by_class() const { return method == VisibilityMethod::kPatchBvh && !single_rays; }
};
// From the keys tilecore.visibility_method, .stencil_segments, .interleaved_times, .traversal, .branch_node and
// .ray_segments.
VisibilityMethodSettings visibility_method(const hardware::GpuConfiguration& gpu);

// A tessellated sub-patch and the samples of the tile that it may touch.
struct MeshInTile {
  const MicroMesh& mesh;
  const TileSamples& samples;
  TimeRange times;  // stencil values of samples that are tested at all
  RayEffects effects;
  const VisibilitySettings&
      settings;                  // the depth of samples limits single rays; bounding polygons have a late depth test
  std::size_t leaf_columns = 1;  // of the sub-patch's grid of leaves
};

// Finds the samples that a mesh covers by any method that is not by_class(); clipped cells are left to
// test_clipped_cells. Hits behind what a sample sees already may be handed over, too. Keeps its scratch memory; one
// instance per tile core.
class MeshVisibility {
 public:
  void test(const MeshInTile& in, const VisibilityMethodSettings& method, HitSink& sink, VisibilityWork& work);

  StencilCounters take_stencil_counters() { return stencil_.take_counters(); }
  RayCounters take_ray_counters() { return bvh_.take_counters(); }

 private:
  // Passes hits on and counts the samples among them, each once a round.
  class DistinctSamples final : public HitSink {
   public:
    DistinctSamples(HitSink& next, std::vector<std::uint64_t>& last_round, std::uint64_t& round)
        : next_(next), last_round_(last_round), round_(round) {}
    void take(std::span<const Hit> hits) override;
    // Samples since the last call.
    std::uint64_t end_round();

   private:
    HitSink& next_;
    std::vector<std::uint64_t>& last_round_;
    std::uint64_t& round_;
    std::uint64_t distinct_ = 0;
  };

  void test_polygons(const MeshInTile& in, const VisibilityMethodSettings& method, DistinctSamples& sink,
                     VisibilityWork& work);
  void test_rays(const MeshInTile& in, const VisibilityMethodSettings& method, DistinctSamples& sink,
                 VisibilityWork& work);
  void test_rectangle(const MeshInTile& in, const VisibilityMethodSettings& method, const RaySpace& space,
                      const IntRect& pixels, std::uint32_t start, DistinctSamples& sink, VisibilityWork& work);

  VisibilitySettings inside_settings_;  // of the mesh at hand, for the inside test
  StencilUnit stencil_;
  MotionBvh bvh_;
  std::vector<BoundingPiece> pieces_;
  std::vector<std::uint32_t> cells_, kept_;
  std::vector<MotionBvh::Ray> rays_;
  std::vector<std::uint64_t> last_round_;  // per sample: round in which it was hit last
  std::uint64_t round_ = 0;
};

}  // namespace tessera::tilecore
