#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace tessera::baselines {

// A base patch after tessellation, domain shading and projection, as a conventional machine bins it. The tessellating code fills it in.
//
// Raster space equals the tile core's: a *projected* vertex has its pixel position on the sub-pixel grid and its depth
// at each key, and moves on screen along the straight line between them; other vertices are homogeneous (xh, yh, depth).
struct TessellatedPatch {
  std::uint32_t number = 0;  // number of the base patch
  std::uint32_t state = 0;   // triangles of one state may share a block
  bool moving = false;       // positions at key 1 differ; the arrays of key 1 are empty otherwise
  bool deforming = false;    // moves in object space, too
  bool keep_positive = true, keep_negative = true;  // facing: sign of the area in raster space
  std::vector<float> x0, y0, z0, x1, y1, z1;
  std::vector<std::uint8_t> projected;
  // Number of each vertex in the draw's index buffer (`state`). Empty if the patch has its own index buffer, as
  // tessellated patches do, and shares no vertex with others.
  std::vector<std::uint32_t> draw_numbers;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // in the order of a strip where possible
  // Ends, in `triangles`, of groups that fit a block: no more than 64 vertices and 126 triangles each.
  std::vector<std::uint32_t> group_ends;
  // By group: number of cells along u if the group is a full rectangle of a grid, with triangles (a, c, d) and (a, b,
  // c) in every cell, row by row; 0 for any other triangles. Empty if all groups are of the other kind.
  std::vector<std::uint8_t> group_columns;
  // Number of each of `triangles` within the base patch, as visibility has them (HitSink::Hit): in a grid two for
  // each cell, row by row along u.
  std::vector<std::uint32_t> triangle_numbers;
  int columns = 0, rows = 0;           // cells of its grid along u and v; 0 for a cluster
  std::uint64_t attribute_bytes = 20;  // bytes of a vertex for the pixel shader, in the precision of the frame
  std::uint64_t domain_evaluations = 0;
  std::uint64_t patch_bytes = 0;             // bursts of its record, for units that fetch it
  std::uint64_t stored_attribute_bytes = 0;  // bursts of the pixel shader's part of the record
  std::uint64_t decoded_elements = 0;        // elements of its record that a decoder gives
};

// Names a triangle by its base patch and its number there, as visibility has them.
constexpr std::uint64_t triangle_name(std::uint32_t patch, std::uint32_t triangle) {
  return static_cast<std::uint64_t>(patch) << 32 | triangle;
}

// Triangles that the samples of each tile see, blended ones included; names in rising order. Deferred attributes are
// fetched and shaded for these alone.
struct VisibleTriangles {
  std::vector<std::vector<std::uint64_t>> tiles;
  bool contains(std::size_t tile, std::uint64_t name) const {
    return std::binary_search(tiles[tile].begin(), tiles[tile].end(), name);
  }
};

}  // namespace tessera::baselines
