#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tilecore/visibility/bounding_polygons.h"
#include "tilecore/visibility/motion_bvh.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/stencil.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// A tessellated sub-patch and the samples of the tile that it may touch.
struct MeshInTile {
  const MicroMesh& mesh;
  const TileSamples& samples;
  TimeRange times;  // stencil values of the tested samples
  RayEffects effects;
  const VisibilitySettings&
      settings;                  // the depth of samples limits single rays; bounding polygons have a late depth test
  std::size_t leaf_columns = 1;  // of the sub-patch's grid of leaves
};

// Finds the samples that a mesh covers by any method that is not by_class(); test_clipped_cells handles clipped cells.
// It may also pass on hits behind the surface that a sample already sees. Owns scratch memory; one instance per tile
// core.
class MeshVisibility {
 public:
  void test(const MeshInTile& in, const VisibilityMethodSettings& method, HitSink& sink, VisibilityWork& work);

  const StencilCounters& stencil_counters() const { return stencil_.counters(); }
  StencilCounters take_stencil_counters() { return stencil_.take_counters(); }
  RayCounters take_ray_counters() { return bvh_.take_counters(); }

 private:
  // Passes hits on and counts the samples among them, each once a round.
  class DistinctSamples final : public HitSink {
   public:
    DistinctSamples(HitSink& next, std::vector<std::uint64_t>& last_round, std::uint64_t& round)
        : next_(next), last_round_(last_round), round_(round) {}
    void take(std::span<const Hit> hits) override;
    void leaf_done() override { next_.leaf_done(); }
    // Returns the number of samples since the last call.
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

  VisibilitySettings inside_settings_;  // of the current mesh, for the inside test
  StencilUnit stencil_;
  MotionBvh bvh_;
  std::vector<BoundingPiece> pieces_;
  std::vector<std::uint32_t> cells_, kept_;
  std::vector<MotionBvh::Ray> rays_;
  std::vector<std::uint64_t> last_round_;  // per sample: round in which it was hit last
  std::uint64_t round_ = 0;
};

}  // namespace tessera::tilecore
