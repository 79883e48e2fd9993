#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace tessera::tilecore {

// A tessellated sub-patch on chip: vertices at one or both motion keys, and cells of up to two triangles with their
// moving boxes. Built right before use, in storage that is used again.
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
  // Corner numbers (a, b, c, d): triangles (a, b, c) and (a, c, d); c == d: one triangle.
  std::array<std::vector<std::int32_t>, 4> corner;
  std::vector<std::uint32_t> triangle;  // number of the first triangle within the base patch
  std::vector<std::uint8_t> used;       // 0: unused slot, or nothing but degenerate triangles
  // Boxes in pixels in the leaf's rest frame (see Leaf). Empty for slots that are unused or clipped.
  std::vector<float> box_x_low, box_x_high, box_y_low, box_y_high;

  // A leaf whose vertices form a grid: its cells lie row by row, `columns` in a row; the first cell's corner a is
  // vertex `first`, and the next row begins `stride` vertices later:
  //     a = first + j stride + i,   b = a + 1,   c = b + stride,   d = a + stride
  // for cell j columns + i. With 0 columns corners are arbitrary.
  struct Grid {
    std::int32_t first = 0, stride = 0, columns = 0;
  };
  static constexpr int kGridColumns = 4;         // at most, and as many rows
  static constexpr std::size_t kRowPadding = 8;  // further elements of the vertex arrays behind a grid's vertices

  // A leaf's cells nearly share their motion and their circle of confusion. The sample is moved back by the shared
  // part, so that the boxes need not hold it: a sample at (x, y, t, u, v) lies in the leaf's *rest frame* at
  //     x' = x - tau(t) drift_x + u lens_factor,    tau(t) = t r / ((1-t) + t r)
  // and the boxes there do not move: they hold every vertex at every time, seen through every point of the lens.
  struct Leaf {
    std::uint32_t cell_count;            // slots in use
    std::uint32_t cells;                 // bit k: slot k has triangles and all its corners are projected
    float rate;                          // r; 1 for static and orthographic
    float drift_x, drift_y;              // pixels from shutter open to close
    float lens_factor;                   // middle of 1/z - 1/f (orthographic: 1 - z/f) over the leaf and the shutter
    float near;                          // no hit of these cells is nearer
    bool flat;                           // no corner changes its depth
    float x_low, x_high, y_low, y_high;  // of all boxes; empty without cells
    Grid grid;                           // only if all cells in use have both triangles
  };
  std::vector<Leaf> leaves;

  // Cells with a vertex that is not projected; they are tested one by one in homogeneous coordinates.
  std::vector<std::uint32_t> clipped_cells;

  std::uint64_t triangle_count = 0;

  void resize_vertices(std::size_t count, bool moving);
  void clear_cells();
  // Appends a cell to the current leaf (see begin_leaf). `first_triangle` numbers triangle (a, b, c); (a, c, d)
  // follows.
  void begin_leaf() { begin_leaf(Grid{}); }
  void begin_leaf(const Grid& grid);
  void add_cell(const std::array<std::int32_t, 4>& corners, std::uint32_t first_triangle);

  // Bytes of the arrays' storage.
  std::size_t memory_bytes() const;
};

// Parameters that all boxes of a mesh share.
struct BoxSettings {
  bool moving = false;
  bool lens = false;
  bool orthographic = false;
  float inverse_focus = 0;
  float lens_scale = 0;    // largest |(u, v)| of a sample
  float sharp_factor = 0;  // see VisibilitySettings
};

// Finishes the cells of a mesh: removes triangles with two corners in one place (a cell that keeps one triangle becomes
// that triangle), sets clipped cells deferred, and builds the boxes of cells and leaves (motion BVH from the
// tessellation pattern: Clarberg and Burns, US 8791945; two levels, since a sub-patch is small). Boxes are widened so
// that they hold every vertex at every time in spite of rounding, of the spread of rates and of circles of confusion
// inside a leaf. Gives the same bits on every instruction set.
void build_cells(MicroMesh& mesh, const BoxSettings& settings);

}  // namespace tessera::tilecore
