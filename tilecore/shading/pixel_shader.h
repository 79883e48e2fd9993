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

// One invocation: where on which surface, and when light falls there, which where samples share it is their mean time.
// `partner_x` and `partner_y`: where its neighbours in a quad are, 1 or -1 pixels away, from which it takes its
// derivatives; 0: its derivatives are the surface's own.
struct Invocation {
  SurfaceLocation at;
  float light_time = 0;
  int partner_x = 0, partner_y = 0;
};

// Time at which a sample at time t sees a patch: what does not move is as it is at shutter open. Mixing two equal poses
// by the time would round, and a still pixel would not stay the same from frame to frame.
inline float time_seen(const scene::FrameGeometry& frame, std::uint32_t patch, float t) {
  return frame.drawable_of(patch).moving ? t : 0.0f;
}

// The pixel shader unit: fetches the material's textures with derivatives from the surface (not from neighbouring
// pixels) and runs the metallic-roughness or the unlit shader. Counted by its caller: one call is one invocation.
// `textures`, unless null, is told of every lookup.
ShadedPoint shade_point(const scene::FrameGeometry& frame, const Lighting& lighting, const Invocation& invocation,
                        TextureUnit* textures = nullptr);

// Alpha of a point as the alpha test sees it: factor, texture filtered over the pixel at the location's time, vertex
// colour.
float point_alpha(const scene::FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures = nullptr);

}  // namespace tessera::tilecore
