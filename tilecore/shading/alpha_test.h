#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "scene/frame_geometry.h"
#include "tilecore/shading/draw_inputs.h"
#include "tilecore/shading/surface.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/shading/vertex_outputs.h"

namespace tessera::tilecore {

// Alpha of a point for the alpha test: factor, texture filtered over the pixel at the location's time, vertex colour.
// It evaluates the patch there.
float point_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at);
// The same with the finest level of the texture, independent of the view; procedures are filtered over the pixel.
float finest_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at);

// The alpha of points on one sub-patch after another, by the method of shading.surface: interpolated between the
// vertices of their triangles, each evaluated once for the sub-patch, or evaluated at the point. Owns scratch memory;
// one instance per thread.
//
// Invariants (cited by the tests):
//   ALT1  At a vertex both are the same, to rounding.
//   ALT2  Alpha is a function of the location alone: not of earlier calls, nor of the tile.
//   ALT3  Many points on SIMD lanes have the alpha of each alone, bit by bit, and ask for the same lines of textures in the
//         same order.
class AlphaTest {
 public:
  static constexpr std::size_t kBatch = 256;  // points at once
  // Starts a sub-patch of a drawable in a frame or a segment of it; both must outlive its use.
  void begin(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);
  // Alpha of a location on it, whose time counts within that frame.
  float alpha(const SurfaceLocation& at, TextureUnit* textures);
  // Alpha of up to kBatch locations on one of its patches.
  void alphas(std::span<const SurfaceLocation> at, TextureUnit* textures, std::span<float, kBatch> out);
  // Vertices evaluated since the last call, and bytes of the tile memory for their coordinates: kMaskVertexBytes
  // written for each vertex, three of them read to test a point.
  struct Work {
    std::uint64_t vertices = 0, bytes = 0;
  };
  Work take_work();

  // A texture coordinate of two floats. The tile memory holds the places of vertices anyway, for the tests of
  // triangles.
  static constexpr std::uint64_t kMaskVertexBytes = 8;

 private:
  // Vertices of its triangle in the mesh.
  std::array<std::int32_t, 3> corners_of(const SurfaceLocation& at);

  const scene::FrameGeometry* frame_ = nullptr;
  bool interpolates_ = false, computed_ = false;  // between vertices; by a procedure
  std::uint32_t last_patch_ = 0, last_triangle_ = SurfaceLocation::kWholePatch;
  std::array<std::int32_t, 3> last_corners_{};
  std::size_t counted_ = 0;  // vertices of this sub-patch
  VertexOutputs vertices_;
  DrawConstants draw_;
  Work work_;
  // Inputs and lines of a batch, in whole vectors.
  std::array<std::array<std::int32_t, kBatch>, 4> vertex_;  // of LaneArrays, then the triangle
  std::array<std::array<float, kBatch>, 4> input_;          // p, q, t, lod
  std::array<std::array<std::int32_t, kBatch>, kLookupLines> lines_;
};

}  // namespace tessera::tilecore
