#pragma once

#include "baselines/deferred_vertex.h"

namespace tessera::baselines {

// A machine without a tessellator: a compute shader writes domain points and indices to memory, and vertices are
// shaded from there as in DeferredVertexBinner [spec: Apple's open driver, 8 bytes a domain point and 4 an index; Arm
// runs tessellation shaders on its compute queue]. Passive meshes have index buffers and bypass this stage.
//
// The parameter buffer has a block for each patch that the hull stage kept:
//   for each vertex u and v, fractions of 32 bits
//   for each triangle three numbers of vertices, 4 bytes each
// Both are read once when positions are shaded to bin, in bursts. A tile reads the indices of its triangles, and the
// points of the vertices that it shades, through the cache of baselines.cache_bytes.
//
// In its favour: the hull shader's factors and control points stay on chip.
//
// Invariants (cited by the tests):
//   CT1  Every domain point and index that a shader reads was written; each patch's are written once.
class TessellatedInMemoryBinner {
 public:
  // [assumed] instructions of a lane: for a point its row and column, two coordinates and a store; for a triangle its
  // cell, six sums and a store; for a patch its counts and its allocation.
  static constexpr std::uint64_t kPointInstructions = 24, kTriangleInstructions = 18, kPatchInstructions = 64;

  TessellatedInMemoryBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid)
      : vertices_(gpu, grid), burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)) {}

  void add(const TessellatedPatch& patch, const TriangleList& list);
  void finish(std::span<const std::uint64_t> state_bytes = {}) { vertices_.finish(state_bytes); }
  const ReferenceLists& lists() const { return vertices_.lists(); }
  const Tessellated& tessellated() const { return tessellated_; }

 private:
  DeferredVertexBinner vertices_;
  Tessellated tessellated_;
  std::uint64_t burst_bytes_;
};

// Encodes the block of a patch.
std::vector<std::uint8_t> encode_tessellation(const TessellatedPatch& patch);

}  // namespace tessera::baselines
