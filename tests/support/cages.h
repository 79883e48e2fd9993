#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include "scene/subdivision/control_cage.h"

namespace tessera::test {

// Catmull-Clark cages made in memory. Every face has vertices of its own (a seam along every edge), TEXCOORD_0 runs
// over [0,1]^2 within each quad and TEXCOORD_1.x is the number of the face, so that a converted patch tells where on
// which face of the cage it lies.
struct Cage {
  scene::Primitive primitive;
  scene::subdivision::CageRules rules;
  std::vector<Vec3> points;               // without repetition
  std::vector<std::array<int, 4>> faces;  // points; the last is -1 for triangles, which follow the quads
};

Cage cage_of(std::vector<Vec3> points, std::vector<std::array<int, 4>> faces);

// nx * ny quads over [0,nx] x [0,ny], heights drawn from [-half, half].
Cage grid_cage(int nx, int ny, float half, std::uint32_t seed);
// The outside of a union of unit cubes, points shifted at random by up to `shift`.
Cage voxel_cage(const std::set<std::array<int, 3>>& cubes, float shift = 0, std::uint32_t seed = 1);
Cage cube_cage();  // from 0 to 1
// An L of three cubes: points of three, four and five edges.
Cage bracket_cage(float shift = 0.2f, std::uint32_t seed = 1);
// The bracket with every third quad cut in two triangles.
Cage mixed_cage();

// The vertex of the primitive at corner k of a face.
std::uint32_t vertex_at(const Cage& cage, std::size_t face, std::size_t k);
// A vertex of the primitive that is this point.
std::uint32_t vertex_of(const Cage& cage, int point);
// Adds a crease along points.
void add_crease(Cage& cage, const std::vector<int>& points, float sharpness = scene::subdivision::kInfinitelySharp);

// A bicubic Bezier patch in double precision.
DVec3 bezier_point(const Vec3* control_points, double u, double v);
// Its derivatives, not normalised.
std::array<DVec3, 2> bezier_tangents(const Vec3* control_points, double u, double v);

}  // namespace tessera::test
