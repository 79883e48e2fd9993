#pragma once

#include "scene/frame_geometry.h"
#include "scene/patch_displacement.h"
#include "shaders_cpp/bicubic.h"

namespace tessera::scene {

// Domain shader: the machine computes a vertex of a Bezier patch as d(u,v) = p(u,v) + n(u,v) * offset(u,v).

shaders::ControlPoints<float> shader_control_points(const FrameGeometry& frame, const PosedDrawable& drawable,
                                                    std::uint32_t patch, std::size_t key);

// The displaced point at one parameter of a patch, in object space at a key: the scalar form of the domain shader.
// `displaced` is false where the caller knows that the offset there is zero.
Vec3 domain_point(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, float u, float v,
                  std::size_t key, bool displaced = true);

// A vertex on the boundary of a grid is evaluated by the owner of the corner or edge that it lies on, so that every
// grid that has it computes the same bits. (i, j) must lie on the boundary of the pattern's grid.
struct OwnedVertex {
  std::uint32_t patch;  // within the drawable
  float u, v;
};
OwnedVertex boundary_vertex(const TessellationPattern& pattern, const PatchNeighbours& neighbours, int i, int j);

// Parameters of corner c: (c & 1, c >> 1).
inline Vec2 corner_parameters(std::size_t corner) {
  return {(corner & 1) != 0 ? 1.0f : 0.0f, (corner & 2) != 0 ? 1.0f : 0.0f};
}

}  // namespace tessera::scene
