#pragma once

#include "scene/frame_geometry.h"
#include "scene/procedure_patch.h"
#include "shaders_cpp/procedures/uniforms.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/surface.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/shading/vertex_outputs.h"

namespace tessera::tilecore {

// Evaluation of procedures at single points, for deferred shading, shading cells and the tessellated path: the
// templates of the SIMD array, on floats.

// Uniform registers of a piece's stages after geometry, at shutter open.
shaders::SurfaceProgram surface_program(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                        const scene::Procedure::Piece& piece);

// A point with its tangents by the patch's own parameters and its unit normal, in object space at a motion key. (u, v)
// are the piece's.
struct ObjectPoint {
  Vec3 position{0.0f}, by_u{0.0f}, by_v{0.0f}, normal{0, 0, 1};
};
ObjectPoint object_point(const scene::ProcedurePatch& at, std::size_t key, float u, float v);

// Fills position, tangents, normal, raster point and its derivatives, but no attributes; parameters are the base
// patch's.
void fill_procedure(const scene::FrameGeometry& frame, std::uint32_t patch, Vec2 parameters, float t, Surface& surface);

// The same for a point on a triangle of the patch's grid, between its vertices; `corner`: their numbers in `vertices`.
void fill_procedure_triangle(const scene::FrameGeometry& frame, const SurfaceLocation& at,
                             const VertexOutputs& vertices, const std::array<std::int32_t, 3>& corner,
                             Surface& surface);

// Texture and shading of a point that one of these functions filled. `lookups` get its texture lookups as lane
// `lane`. With ShadingId::kMaterial the material's textures of base colour, normals, metalness and roughness, occlusion
// and emission are read; a surface that blends always reads its base colour texture. All are read at (u, v) of the
// whole procedure, whatever their sets of coordinates. `shadowed`: the shadows of each light; nullptr: none.
ShadedPoint shade_procedure(const scene::FrameGeometry& frame, const Lighting& lighting,
                            const shaders::ShadowView* shadowed, const shaders::Lights& lights,
                            const SurfaceLocation& at, const Surface& surface, const Vec3& view,
                            const LookupArrays& lookups, std::size_t lane);

// Alpha of a point: the material's, times its base colour texture's; `textures`, unless nullptr, fetches the texels.
float procedure_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures);

}  // namespace tessera::tilecore
