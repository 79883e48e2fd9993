#pragma once

#include <array>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// Displacement of one Bezier patch: the texture coordinates of its four corners, transformed, and the level of detail
// at which its vertices read the heights. Coordinates inside are bilinear between the corners; the texture coordinates
// of the inner control points are not used.
struct PatchDisplacement {
  const Displacement* material = nullptr;
  std::array<Vec2, 4> corner;  // (0,0), (1,0), (0,1), (1,1)
  float lod = 0;

  Vec2 coordinate(float u, float v) const {
    const Vec2 low = corner[0] * (1.0f - u) + corner[1] * u, high = corner[2] * (1.0f - u) + corner[3] * u;
    return low * (1.0f - v) + high * v;
  }
  // Box of the coordinates over a box of parameters: the coordinates are bilinear, so it is the hull of the box's
  // corners.
  struct Footprint {
    Vec2 low, high;
  };
  Footprint footprint(const ParameterRange& r) const {
    const Vec2 a = coordinate(r.u0, r.v0), b = coordinate(r.u1, r.v0), c = coordinate(r.u0, r.v1),
               d = coordinate(r.u1, r.v1);
    return {glm::min(glm::min(a, b), glm::min(c, d)), glm::max(glm::max(a, b), glm::max(c, d))};
  }
  // Signed offset along the unit normal.
  float offset(float u, float v) const {
    return material->scale * material->texture->sample(material->sampler, coordinate(u, v), lod) + material->bias;
  }
};

// Both require a Bezier patch whose material displaces.
//
// The level of detail is log2 of the number of texels that one cell of the patch's grid spans, along the direction with
// more texels, plus TessellationSettings::displacement_bias, and never below 0. It needs the patch's pattern and is
// kept in FrameGeometry::displacement_lod.
float choose_displacement_lod(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch);
PatchDisplacement patch_displacement(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch);

}  // namespace tessera::scene
