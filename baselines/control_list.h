#pragma once

#include "baselines/reshading.h"

namespace tessera::baselines {

// A machine whose tile lists hold packed primitives over one vertex buffer. It shades coordinates to bin, and
// vertices again to render [spec: Broadcom V3D; coordinate and vertex shaders]. Lists are blocks of 64 bytes [spec:
// v3dv's initial list], chained by a link [spec: a branch packet; assumed: 4 bytes as in this machine's chunks].
//
// Packets. A vertex is named by its number in the order of drawing; vertices of a patch are numbered row by row [assumed:
// after the compressed primitive lists of VideoCore IV, which name vertices relative to earlier ones]:
//   byte, bits 0..1 k: 0, 1, 2: the triangle shares edge (p[k], p[k+1]) of the list's triangle before, p, in the other
//     direction, and has one further vertex; bit 2: it is named from p[k] (1) or p[k+1] (0)
//   k = 3, bit 2 = 0: three vertices follow; the first is named from the last one of the triangle before
//   bits 3..7: distance of the vertex from that one, plus 15; 31: a number follows, zigzag
//   with k = 3, two numbers, zigzag: the other vertices, from the first
//   k = 3, bit 2 = 1: the drawable of the following triangles, 4 bytes
// Before the first triangle, p is vertex 0 three times.
//
// Invariants (cited by the tests):
//   CL1  Every triangle that setup keeps is in the list of every tile that it may touch, once.
//   CL2  Each tile shades each vertex of its triangles once, and no other.
class ControlListBinner {
 public:
  ControlListBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid);

  void add(const TessellatedPatch& patch, const TriangleList& list);
  void finish(std::span<const std::uint64_t> state_bytes = {}) { lists_.finish(state_bytes); }
  const ReferenceLists& lists() const { return lists_; }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  struct Place {
    Triangle before{};
    std::uint32_t state = ~0u;
  };
  void put_triangle(const Triangle& triangle, Place& place, std::vector<std::uint8_t>& bytes) const;

  ReferenceLists lists_;
  std::vector<Place> last_;  // by tile
};

}  // namespace tessera::baselines
