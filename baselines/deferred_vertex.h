#pragma once

#include "baselines/reshading.h"

namespace tessera::baselines {

// A machine that shades positions to bin triangles, keeps no vertex, and shades vertices again in each tile [spec:
// Arm's 5th generation, deferred vertex shading: the binning phase writes primitive metadata only].
//
// A tile's list, in the order of drawing:
//   number (7 bits a byte): base patch, less the patch of the reference before
//   if the patch has several groups of triangles, a number: the group, less the group of the reference before if that has
//     the same patch
//   the triangles of the group that touch the tile, as in tile_reference.h, out of all triangles of the group
// The patch gives the draw; factors, and with them groups (7x7 cells, a cluster), come from the patch's record [assumed].
//
// Invariants (cited by the tests):
//   DV1  Every triangle that setup keeps is in the list of every tile that it may touch, once.
//   DV2  Each tile shades each vertex of its triangles once, and no other.
class DeferredVertexBinner {
 public:
  DeferredVertexBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid)
      : lists_(gpu, grid), last_(grid.tile_count()) {}

  // `tessellation`: addresses of the patch's domain points and indices, if they are in memory.
  void add(const TessellatedPatch& patch, const TriangleList& list,
           const std::optional<Reshading::Tessellation>& tessellation = std::nullopt);
  void finish(std::span<const std::uint64_t> state_bytes = {}) { lists_.finish(state_bytes); }
  const ReferenceLists& lists() const { return lists_; }
  ReferenceLists& lists() { return lists_; }

 private:
  struct Place {
    std::uint32_t patch = 0, group = 0;
  };
  ReferenceLists lists_;
  std::vector<Place> last_;  // by tile
};

}  // namespace tessera::baselines
