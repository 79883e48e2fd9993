#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/vec.h"
#include "captures/sources/asset.h"

namespace tessera::captures {

inline constexpr float kPi = 3.14159265f;

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

// Triangle mesh of a function over [0,1]^2, (nu+1) x (nv+1) vertices with normals from differences. At poles, where
// the differences vanish, the normal is the direction from the origin.
Geometry mesh_of(const std::function<Vec3(float, float)>& surface, int nu, int nv);

// A corner of a bilinear patch; `light` is a factor of the base colour.
struct Corner {
  Vec3 at;
  Vec2 texcoord;
  Vec3 light{1.0f};
};

// Appends a bilinear patch with corners at (u, v) = (0, 0), (1, 0), (0, 1), (1, 1); its front faces along u x v.
// Control points lie on a grid, so that patches with two common corners share the edge.
void add_patch(Geometry& g, const std::array<Corner, 4>& corners);
// The same with 16 control points, u running fastest; corners give texture coordinates and light only. The cage of a
// patch that bends across u is fine, the cage of other patches has three quads.
void add_patch(Geometry& g, const std::array<Vec3, 16>& points, const std::array<Corner, 4>& corners, bool fine_cage);

// nu x nv patches through a function over [0,1]^2; `light` is evaluated at the middle of each patch.
Geometry patches_of(const std::function<Vec3(float, float)>& surface, int nu, int nv,
                    const std::function<Vec3(float, float)>& light);

// Appends patches with texture coordinates and colours to `to`.
void append(Geometry& to, const Geometry& patches);

// Appends faces of an axis-parallel box as patches: bit 2 * axis + 1 of `faces` is the face at the larger coordinate.
// Texture coordinates are metres times `scale`.
inline constexpr unsigned kAllFaces = 63, kNoBottom = 63 & ~4u, kNoBack = 63 & ~16u;
void add_box(Geometry& g, Vec3 low, Vec3 high, unsigned faces, float scale, Vec3 light = Vec3(1.0f));

// A box with flat faces.
Geometry box(Vec3 half_extent);

}  // namespace tessera::captures
