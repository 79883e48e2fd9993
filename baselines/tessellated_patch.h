#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace tessera::baselines {

// A base patch after tessellation, domain shading and projection, as a conventional machine bins it. Whoever
// tessellates fills it.
//
// Raster space as the tile core has it: a *projected* vertex has its pixel position on the sub-pixel grid and its depth
// at each key, and moves on screen along the straight line between them; others are homogeneous (xh, yh, depth).
struct TessellatedPatch {
  std::uint32_t number = 0;                         // base patch
  std::uint32_t state = 0;                          // triangles of one state may share a block
  bool moving = false;                              // key 1 differs; its arrays are empty otherwise
  bool deforming = false;                           // in object space, too
  bool keep_positive = true, keep_negative = true;  // facing: sign of the area in raster space
  std::vector<float> x0, y0, z0, x1, y1, z1;
  std::vector<std::uint8_t> projected;
  // Numbers of the vertices in the index buffer of the draw, `state`. Empty: the patch has an index buffer of its own, as
  // tessellated ones do, and shares no vertex with others.
  std::vector<std::uint32_t> draw_numbers;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // in the order of a strip where possible
  // Ends, in `triangles`, of groups that fit a block: no more than 64 vertices and 126 triangles each.
  std::vector<std::uint32_t> group_ends;
  // Of each group, cells along u when it is a rectangle of a grid: all of whose cells have the triangles (a, c, d) and
  // (a, b, c), row by row. 0: any triangles. Empty: all groups are such.
  std::vector<std::uint8_t> group_columns;
  // Numbers of `triangles` within the base patch, as visibility has them (HitSink::Hit): of a grid, two for each cell, row
  // by row along u.
  std::vector<std::uint32_t> triangle_numbers;
  int columns = 0, rows = 0;           // cells of its grid along u and v; 0: a cluster
  std::uint64_t attribute_bytes = 20;  // that a vertex hands to the pixel shader, in the precision of the frame
  std::uint64_t domain_evaluations = 0;
  std::uint64_t patch_bytes = 0;             // bursts of its record, for whoever fetches it
  std::uint64_t stored_attribute_bytes = 0;  // and of what records hold for the pixel shader
  std::uint64_t decoded_elements = 0;        // that a decoder gives of its record
};

// A triangle by the number of its base patch and its own number there, as visibility has them.
constexpr std::uint64_t triangle_name(std::uint32_t patch, std::uint32_t triangle) {
  return static_cast<std::uint64_t>(patch) << 32 | triangle;
}

// Which triangles the samples of each tile see, blended ones included: names in rising order. What is deferred is
// fetched and shaded for these alone.
struct VisibleTriangles {
  std::vector<std::vector<std::uint64_t>> tiles;
  bool contains(std::size_t tile, std::uint64_t name) const {
    return std::binary_search(tiles[tile].begin(), tiles[tile].end(), name);
  }
};

}  // namespace tessera::baselines
