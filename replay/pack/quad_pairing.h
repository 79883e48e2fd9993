#pragma once

#include "scene/capture.h"

namespace tessera::replay {

// The triangles of a mesh, with as many as possible joined into quads, in the order of TESSERA_subdivision: two
// triangles (a, b, c), (a, c, d) for each quad, then the triangles without a partner.
struct QuadDominantMesh {
  std::vector<std::uint32_t> indices;
  std::size_t quads = 0, triangles = 0;  // faces
};

// Undoes the triangulation of a quad-dominant mesh. Pairs of triangles that share an edge are joined, the best ones
// first: flat, close to a rectangle, adjacent in the file. Pairs that are bent by more than `max_bend` degrees, or have
// an angle below 20 or above 160 degrees, stay apart, and so do pairs with a seam of texture coordinates or colours
// between them. Vertices that differ only in normals and tangents become the first of them.
QuadDominantMesh pair_into_quads(const scene::Primitive& mesh, double max_bend = 45.0);

// Edges (pairs of vertices) at which two faces of the mesh meet at more than so many degrees, across seams as well. The
// diagonals of the first `quads` pairs of triangles are no edges.
std::vector<std::array<std::uint32_t, 2>> edges_sharper_than(const scene::Primitive& mesh, std::size_t quads,
                                                             double degrees);

}  // namespace tessera::replay
