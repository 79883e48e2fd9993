#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"
#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/ray_effects.h"

namespace tessera::tilecore {

// Replaces `others` by the patches whose records are fetched for a sub-patch besides its own, in order: the owners of
// its boundary vertices if these are displaced (plain edges are computed from the patch's own control points, which are
// the same).
void fetched_neighbours(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                        bool displaced, std::vector<std::uint32_t>& others);

// Tessellates sub-patches on demand: domain shading at both motion keys, projection, cells, boxes. A vertex is computed
// from its base patch alone, whichever sub-patch asks, and vertices on shared edges and corners by the patch that owns
// them: grids meet without cracks, displaced or not.
//
// Owns scratch memory; one instance per thread.
class Tessellator {
 public:
  // Work of a call, for the counters and the ledger of the tile core.
  struct Work {
    std::uint64_t domain_evaluations = 0;  // vertices shaded (both motion keys count once)
    std::uint64_t triangles = 0;
  };

  // Fills key 1 and moving boxes if `effects` has motion (which a sub-patch that moves requires), and widens boxes for
  // the lens if it has one. Without `displaced` no displacement map is read; the caller knows that it is zero there.
  Work tessellate(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                  RayEffects effects, MicroMesh& mesh, bool displaced = true);

  // Position of one vertex in object space at a key, the same for all grids that share it. For tests and bounds.
  static Vec3 vertex_position(const scene::FrameGeometry& frame, std::uint32_t patch, int i, int j, int key,
                              bool displaced = true);

 private:
  template <bool kDisplaced>
  void shade_bezier(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, std::uint32_t patch,
                    const scene::CellRange& range, std::size_t key);
  void shade_procedure(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                       std::size_t key);
  void shade_cluster(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, std::uint32_t patch,
                     std::size_t key);
  void resize(std::size_t vertices);

  struct Points {
    std::vector<float> x, y, z;
    void resize(std::size_t n) { x.resize(n), y.resize(n), z.resize(n); }
  };
  std::array<Points, 2> object_;
  Points normal_;
  std::vector<float> u_, v_, offset_, margin_, texture_u_, texture_v_;
};

}  // namespace tessera::tilecore
