#pragma once

#include <array>
#include <cstdint>

#include "scene/frame_geometry.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {

// Name of a shading cell: its base patch, its part of the patch, and its cell of the part's grid. Equal names mean
// equal cells, for every tile, sample and time.
struct ShadingCell {
  std::uint32_t patch = 0;
  std::uint32_t part = 0;      // block of a Bezier patch, row by row; triangle of a cluster
  std::uint16_t i = 0, j = 0;  // along p and q
  // These follow from patch and part. The part has 2^i_bits x 2^j_bits cells; a triangle's grid starts at its corner
  // `origin` and runs along the sides to the next corner and to the one after.
  std::uint8_t i_bits = 0, j_bits = 0, origin = 0;

  bool operator==(const ShadingCell& other) const {
    return patch == other.patch && part == other.part && i == other.i && j == other.j;
  }
};

// Cuts surfaces into shading cells about one pixel wide on screen: the domain in which shading is decoupled from
// visibility (Ragan-Kelley et al. 2011), laid in the surface's own parameters (Burns et al. 2010), where a point keeps
// its cell however the surface moves or is defocused.
//
// A Bezier patch is cut into up to 16 x 16 blocks that are at least eight pixels wide by the patch's tessellation
// factors; a cluster into its triangles. Each of these parts has a grid of 2^a x 2^b cells, a triangle's laid from the
// corner that is closest to a right angle. Their sides on screen at mid-shutter are between 0.7 and 1.4 pixels where p
// and q cross at right angles; where they do not, cells are made longer, up to twice, so that they keep the area of a
// pixel. (Deviation from Burns et al.: one density for a part, not for a grid of micropolygons.)
//
// Invariants (cited by the tests):
//   CELL1  The cell of a point follows from the frame, the patch and the point's parameters alone.
//   CELL2  The canonical point of a cell lies in the cell and on the surface.
// A part smaller than a cell is one cell: triangles below the size of a pixel are shaded one by one.
class ShadingCells {
 public:
  // Time at which cells are measured and shaded: uniform motion is then shaded at its mean.
  static constexpr float kTime = 0.5f;
  static constexpr int kMaxBits = 10;  // 1024 cells along a part

  // Forgets its measurements; call it before another frame. Cells are `cell_pixels` pixels wide instead of one.
  void start(const scene::FrameGeometry& frame, float cell_pixels = 1);

  ShadingCell cell_of(const SurfaceLocation& at);

  // The point at which the cell is shaded: its middle; if pixels interpolate, as a place on the triangle of the patch's
  // grid that holds it. If a cluster triangle's third side cuts the cell, about the middle of the remainder.
  static SurfaceLocation canonical_point(const scene::FrameGeometry& frame, const ShadingCell& cell);

 private:
  struct Grid {
    std::uint8_t i_bits = 0, j_bits = 0, origin = 0;
  };
  Grid grid_of(std::uint32_t patch, std::uint32_t part);

  // Recent measurements, direct mapped. They are values of a pure function, so eviction does not change results.
  struct Measured {
    std::uint32_t patch = SurfaceLocation::kWholePatch, part = 0;
    Grid grid;
  };
  std::array<Measured, 4096> measured_;
  const scene::FrameGeometry* frame_ = nullptr;
  float cell_pixels_ = 1;
};

}  // namespace tessera::tilecore
