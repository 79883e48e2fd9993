#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/block_code.h"
#include "baselines/depth_pyramid.h"
#include "baselines/tessellated_patch.h"
#include "baselines/triangle_setup.h"

namespace tessera::baselines {

// Most outputs of a mesh shader's workgroup [spec: NVIDIA's advice is 64 vertices and 124 to 126 triangles; clusters have
// these limits, too], and most segments along an edge of a patch in one of them [spec: NVIDIA's vk_tessellated_clusters].
inline constexpr std::size_t kMeshletVertices = 64, kMeshletTriangles = 124;
inline constexpr int kMeshletSegments = 11;

// A workgroup of a mesh shader: a cluster, or a rectangle of cells of a patch.
struct Meshlet {
  bool part = false;                     // the patch has more
  std::vector<std::uint32_t> vertices;   // of the TessellatedPatch, rising
  std::vector<std::uint32_t> numbers;    // of its triangles, in TessellatedPatch::triangles, rising
  std::vector<BlockTriangle> triangles;  // the same, by places in `vertices`
};

// Cells along u and v of all parts of a grid of so many cells, but for the last ones: so large that there are fewest parts,
// then so that they have fewest vertices.
struct MeshletCells {
  int columns, rows;
};
MeshletCells meshlet_cells(int columns, int rows);

// Invariants (cited by the tests):
//   MC1  Every triangle of a patch is in one of its meshlets, once, and none exceeds the limits above.
std::vector<Meshlet> cut_into_meshlets(const TessellatedPatch& patch);

// Task shaders: they drop meshlets that lie outside the view or face away, and those that are hidden.
//
// In favour of machines that have them: bounds are as tight as vertices, so that a meshlet is outside or faces away when
// set-up would drop all of its triangles; and what hides it is what this very frame sees in the end, as if the frame before
// had seen the same. Nothing that is seen is ever dropped, so that no second pass is needed.
//
// Invariants (cited by the tests):
//   MS1  A meshlet with a triangle that is seen is kept.
class TaskShader {
 public:
  // [assumed] instructions of a lane for one meshlet: its bound through a matrix (24, both motion keys), four planes and
  // two depths (16), the cone (14), its rectangle on screen (40), the level of the pyramid and the comparison (14), its
  // place among those that stay (20). Stored bounds are read; for a part of a patch 900 more bound it, as those that the
  // front end counts (energy.bound_pj).
  static constexpr std::uint64_t kTestInstructions = 128, kBoundInstructions = 900;

  TaskShader(const TriangleSetup& setup, const DepthPyramid& depths) : setup_(setup), depths_(depths) {}

  struct Counts {
    std::uint64_t parts = 0;    // tested beside the whole patches and clusters of the hull stage
    std::uint64_t hidden = 0;   // meshlets that the pyramid dropped
    std::uint64_t lookups = 0;  // in it
    // Instructions for `tests` of whole meshlets, and for the parts.
    std::uint64_t instructions(std::uint64_t tests) const {
      return tests * kTestInstructions + parts * (kTestInstructions + kBoundInstructions);
    }
  };
  // The meshlets of a patch that stay. `list`: what set-up makes of the patch.
  std::vector<Meshlet> run(const TessellatedPatch& patch, const TriangleList& list);
  const Counts& counts() const { return counts_; }

 private:
  const TriangleSetup& setup_;
  const DepthPyramid& depths_;
  Counts counts_;
};

}  // namespace tessera::baselines
