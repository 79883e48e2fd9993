#pragma once

#include "scene/frame_geometry.h"
#include "shaders_cpp/procedures/uniforms.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/surface.h"
#include "tilecore/shading/texture_unit.h"

namespace tessera::tilecore {

// Procedures where single points are asked for: deferred shading, shading cells, the tessellated path. The same
// templates as in the SIMD array, on floats.

// Uniform registers of a piece's stages after geometry. Time is shutter open's.
shaders::SurfaceProgram surface_program(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                        const scene::Procedure::Piece& piece);

// Fills position, tangents, normal, raster point and its derivatives; parameters are those of the base patch. No
// attributes.
void fill_procedure(const scene::FrameGeometry& frame, std::uint32_t patch, Vec2 parameters, float t, Surface& surface);

// Texture and shading of a point that fill_procedure made. What it looks up is told as that of lane `lane`. With
// ShadingId::kMaterial the material's textures of base colour, normals, metalness and roughness, occlusion and emission
// are read, where it blends that of base colour in any case, all of them at (u, v) of the whole procedure, whatever their sets of coordinates.
ShadedPoint shade_procedure(const scene::FrameGeometry& frame, const Lighting& lighting, const shaders::Lights& lights,
                            const SurfaceLocation& at, const Surface& surface, const Vec3& view,
                            const LookupArrays& lookups, std::size_t lane);

// Alpha of a point: the material's, times its base colour texture's; `textures`, unless null, fetches what that takes.
float procedure_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures);

}  // namespace tessera::tilecore
