#pragma once

#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "scene/frame_geometry.h"
#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::tilecore {

// Vertices of a base patch that are kept and evaluated together: 8x8 of its grid, from its corner on, or all vertices
// of a cluster. Adjacent sub-patches of one patch share the vertices on their common border.
struct VertexGroup {
  static constexpr int kSide = 8;
  static constexpr std::size_t kVertices = 64;  // at most

  std::uint16_t number = 0;    // within the base patch
  std::uint8_t room = 0;       // number of its vertices in the patch
  std::uint64_t vertices = 0;  // its vertices in the sub-patch, a bit each
  // Pixels that cells of the sub-patch with a vertex of the group may touch while the shutter is open, through any
  // point of the lens; the whole plane if a vertex of the sub-patch is not projected.
  IntRect pixels;
};

// The groups of a sub-patch whose `mesh` is built. No vertex is in two of them.
//
// Invariant (cited by the tests):
//   VG1  A tile that a leaf of the mesh may touch (touching_times) overlaps the pixels of each group that holds a vertex
//        of the leaf's cells.
std::vector<VertexGroup> vertex_groups(const scene::FrameGeometry& frame, std::uint32_t patch,
                                       const scene::CellRange& range, const MicroMesh& mesh, float lens_scale);

}  // namespace tessera::tilecore
