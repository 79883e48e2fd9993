#pragma once

#include "scene/frame_geometry.h"
#include "shaders_cpp/environment.h"
#include "tilecore/shading/surface.h"
#include "tilecore/shading/texture_unit.h"

namespace tessera::tilecore {

// Light of the whole frame.
struct Lighting {
  shaders::Environment environment;
};

struct ShadedPoint {
  Vec3 color{0.0f};  // linear, not multiplied by alpha
  float alpha = 1.0f;
  Vec3 normal{0.0f};  // world, after normal map, facing the viewer
};

// The pixel shader unit: fetches the material's textures with derivatives from the surface (not from neighbouring
// pixels) and runs the metallic-roughness or the unlit shader. Counted by its caller: one call is one invocation.
// `textures`, unless null, is told of every lookup.
ShadedPoint shade_point(const scene::FrameGeometry& frame, const Lighting& lighting, const SurfaceLocation& at,
                        TextureUnit* textures = nullptr);

// Alpha of a point as the alpha test and blending see it: factor, texture at its finest level, vertex colour.
float point_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures = nullptr);

// Direction from a point of the image into the scene, in world space, at shutter open.
Vec3 view_direction(const scene::FrameGeometry& frame, float pixel_x, float pixel_y);

}  // namespace tessera::tilecore
