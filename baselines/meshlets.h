#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/block_code.h"
#include "baselines/depth_pyramid.h"
#include "baselines/tessellated_patch.h"
#include "baselines/triangle_setup.h"

namespace tessera::baselines {

// Limits of a mesh shader's workgroup [spec: NVIDIA's advice is 64 vertices and 124 to 126 triangles; clusters have these
// limits, too], and of segments along an edge of a patch in one workgroup [spec: NVIDIA's vk_tessellated_clusters].
inline constexpr std::size_t kMeshletVertices = 64, kMeshletTriangles = 124;
inline constexpr int kMeshletSegments = 11;

// A workgroup of a mesh shader: a cluster, or a rectangle of cells of a patch.
struct Meshlet {
  bool part = false;                     // the patch has further meshlets
  std::vector<std::uint32_t> vertices;   // vertices of the TessellatedPatch, rising
  std::vector<std::uint32_t> numbers;    // numbers in TessellatedPatch::triangles, rising
  std::vector<BlockTriangle> triangles;  // the same triangles, by positions in `vertices`
};

// Cells along u and v of all parts of a grid except the last ones. The choice gives the fewest parts, and then the fewest vertices.
struct MeshletCells {
  int columns, rows;
};
MeshletCells meshlet_cells(int columns, int rows);

// Invariants (cited by the tests):
//   MC1  Every triangle of a patch is in one of its meshlets, once, and none exceeds the limits above.
std::vector<Meshlet> cut_into_meshlets(const TessellatedPatch& patch);

// Task shaders drop meshlets that lie outside the view, face away or are hidden.
//
// Two assumptions favour machines that have them. Bounds are as tight as vertices: a meshlet is outside or faces away
// when set-up would drop all of its triangles. And a meshlet is hidden by the depth of this finished frame, as if the
// frame before had been the same. A visible meshlet is never dropped, so no second pass is needed.
//
// Invariants (cited by the tests):
//   MS1  A meshlet with a visible triangle is kept.
class TaskShader {
 public:
  // [assumed] instructions of a lane for one meshlet: its bound through a matrix (24, both motion keys), four planes
  // and two depths (16), the cone (14), its rectangle on screen (40), the level of the pyramid and the comparison
  // (14), its place among the kept ones (20). Stored bounds are read; computing the bound of a part of a patch takes
  // 900 more, as in the front end (energy.bound_pj).
  static constexpr std::uint64_t kTestInstructions = 128, kBoundInstructions = 900;

  TaskShader(const TriangleSetup& setup, const DepthPyramid& depths) : setup_(setup), depths_(depths) {}

  struct Counts {
    std::uint64_t parts = 0;    // parts tested, besides the whole patches and clusters of the hull stage
    std::uint64_t hidden = 0;   // meshlets that the pyramid dropped
    std::uint64_t lookups = 0;  // lookups in the pyramid
    // Instructions for `tests` whole meshlets and all parts.
    std::uint64_t instructions(std::uint64_t tests) const {
      return tests * kTestInstructions + parts * (kTestInstructions + kBoundInstructions);
    }
  };
  // Returns the kept meshlets of a patch. `list`: the patch after set-up.
  std::vector<Meshlet> run(const TessellatedPatch& patch, const TriangleList& list);
  const Counts& counts() const { return counts_; }

 private:
  const TriangleSetup& setup_;
  const DepthPyramid& depths_;
  Counts counts_;
};

}  // namespace tessera::baselines
