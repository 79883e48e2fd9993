#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/vec.h"
#include "captures/sources/asset.h"

namespace tessera::captures {

// A cubic curve in the (radius, height) plane of a surface of revolution.
using ProfileSegment = std::array<Vec2, 4>;

// Smooth profile through points (Catmull-Rom tangents); `round_start` and `round_end` make the tangent at an end
// horizontal, so that a surface closes smoothly at its pole.
std::vector<ProfileSegment> smooth_profile(const std::vector<Vec2>& points, bool round_start, bool round_end);

// Bezier patches: the profile turned about +y in four quarters (circles to 2.7e-4). Texture coordinates run 0..1 around
// (u) and 0..1 from the profile's end to its start (v), so that images stand upright. Normals point outwards when the
// profile runs upwards.
Geometry revolve(const std::vector<ProfileSegment>& profile);

// Flat rectangle in the xz plane, facing +y, of nx x nz bilinear patches; texture coordinates 0..1.
Geometry ground(Vec2 low, Vec2 high, int nx, int nz);

// Triangle mesh of a function over [0,1]^2, (nu+1) x (nv+1) vertices with normals from differences; at poles, where
// those vanish, the direction from the origin.
Geometry mesh_of(const std::function<Vec3(float, float)>& surface, int nu, int nv);

// A box with flat faces.
Geometry box(Vec3 half_extent);

}  // namespace tessera::captures
