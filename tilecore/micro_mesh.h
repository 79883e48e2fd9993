#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace tessera::tilecore {

// A tessellated sub-patch on chip: vertices at one or both keys, and cells of up to two triangles with their moving
// boxes. Built right before use, in storage that is used again.
//
// Raster-space vertices. A vertex that lies in front of the near plane and inside the guard band at its keys is
// *projected*: x, y are pixels on the sub-pixel grid (exact in float), z its depth. It moves on screen along a straight
// line, at the perspective-correct rate
//     lambda(t) = t z1 / ((1-t) z0 + t z1)        (orthographic: lambda = t)
// so x(t) = x0 + lambda (x1 - x0), exactly x0 when it does not move. Other vertices stay homogeneous: x, y are xh, yh,
// z is depth, all linear in t.
inline constexpr std::size_t kLeafCells = 16;

struct MicroMesh {
  // ---- Vertices ----
  std::size_t vertex_count = 0;
  std::vector<float> x0, y0, z0, x1, y1, z1;  // key 1 is filled for moving meshes only
  std::vector<std::uint8_t> projected;
  bool all_projected = true;

  // ---- Cells, leaf by leaf; leaf l owns slots 16 l .. 16 l + 15 ----
  // Corner numbers (a, b, c, d): triangles (a, b, c) and (a, c, d); c == d: one triangle. Unused slots have an empty box.
  std::array<std::vector<std::int32_t>, 4> corner;
  std::vector<std::uint32_t> triangle;        // number of the first triangle within the base patch
  std::vector<std::uint8_t> used;             // 0: unused slot
  // Boxes in pixels: [low + tau d_low, high + tau d_high], tau the leaf's rate at time t. Static: at tau = 0.
  std::vector<float> box_x_low, box_x_high, box_y_low, box_y_high;
  std::vector<float> box_x_d_low, box_x_d_high, box_y_d_low, box_y_d_high;

  struct Leaf {
    std::uint32_t cell_count;
    float rate;                   // r of tau(t) = t r / ((1-t) + t r); 1 for static and orthographic
    float coc_low, coc_high;      // range of the lens factor (1/z - 1/f, or 1 - z/f) over the leaf and the shutter
    float x_low, x_high, y_low, y_high, x_d_low, x_d_high, y_d_low, y_d_high;  // box of all its cells
  };
  std::vector<Leaf> leaves;

  // Cells with a vertex that is not projected: tested one by one in homogeneous coordinates.
  std::vector<std::uint32_t> clipped_cells;

  std::uint64_t triangle_count = 0;

  void resize_vertices(std::size_t count, bool moving);
  void clear_cells();
  // Appends a cell with distinct triangles to the current leaf (see begin_leaf); corners that coincide reduce it to one
  // triangle or to nothing. `first_triangle` numbers triangle (a, b, c); (a, c, d) follows.
  void begin_leaf();
  void add_cell(const std::array<std::int32_t, 4>& corners, std::uint32_t first_triangle, bool moving);
};

// Parameters that all boxes of a mesh share.
struct BoxSettings {
  bool moving = false;
  bool lens = false;
  bool orthographic = false;
  float inverse_focus = 0;
};

// Builds the boxes of every cell and leaf from the vertices (motion BVH from the tessellation pattern: Clarberg and
// Burns, US 8791945). Boxes are widened so that they hold every vertex at every time in spite of rounding, and of the
// spread of rates inside a leaf.
void build_boxes(MicroMesh& mesh, const BoxSettings& settings);

}  // namespace tessera::tilecore
