#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/rect.h"
#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/stencil.h"

namespace tessera::tilecore {

// 8 u of single precision: the unit of margins for the rounding of the inside test.
inline constexpr double kRoundingMargin = 0x1p-21;

// Whether a cell has triangles and all its corners have screen positions; test_clipped_cells handles the others.
bool is_projected(const MicroMesh& mesh, std::size_t cell);

// Bounds of the hits of a primitive of a few projected vertices: a box of pixels over an interval of time, lens and the
// rounding of the inside test included.
//
// A sample is hit only when it lies in the hull of the corners as the inside test rounds them (its signs are never the
// opposite of the exact ones). So the box of the exact vertices, widened by the rounding of a corner, is enough. A
// vertex moves along a straight line at a rate that is monotone in t, so over [t0, t1] it stays between its two ends;
// so does its depth, and with it the circle of confusion.
//
// Rounding of a corner (u = 2^-24; Z the larger, z the smallest depth of the vertex over the interval, d its way, R the
// lens radius, f the focus, W the size of the primitive's box, which bounds the corner's distance from a sample
// inside):
//   depth     |dz| <= 2 u Z                                 one fma of a rounded difference
//   rate      |dl| <= 2 u Z / z + 2 u <= 4 u Z / z          a quotient and a product; exact when orthographic
//   lens      |dc| <= (2 u Z / z + u) / z + u |c|           perspective; u (3 Z / f + |c|) when orthographic
//   corner    |dx| <= |d| |dl| + R |dc| + 2 u W             two more fused additions
// The margin is 8 u (|d| Z / z + W + R C) with C = Z / z^2 + 1 / z + 1 / f (Z / f + 1 when orthographic), twice W's
// share and more than 1.5 times the rest.
class PrimitiveBound {
 public:
  // `lens_radius` in pixels per unit of the lens factor; 0 without a lens.
  PrimitiveBound(const MicroMesh& mesh, RayEffects effects, const VisibilitySettings& settings, double lens_radius)
      : mesh_(mesh),
        moving_(effects.motion),
        orthographic_(settings.orthographic),
        inverse_focus_(static_cast<double>(settings.inverse_focus)),
        radius_(effects.lens ? lens_radius * (1 + 0x1p-20) : 0) {}  // points of the lens are rounded, too

  void clear() { vertices_.clear(); }
  bool empty() const { return vertices_.empty(); }
  // All corners of a cell, which must be projected.
  void add_cell(std::size_t cell);

  struct Box {
    double x0, y0, x1, y1;  // closed
  };
  Box over(double t0, double t1) const;

  // Pixels of `within` whose samples [x, x+1) x [y, y+1) may be hit during the interval.
  IntRect pixels(double t0, double t1, const IntRect& within) const;

  // Interval of times at which the primitive may be over `pixels`: exact up to the margin, which is taken over the
  // whole shutter. Empty when low > high. If vertices enter and leave in opposite directions it is the hull.
  struct Times {
    double low = 0, high = 1;
  };
  Times times_over(const IntRect& pixels) const;

  // Larger side of the box at open or close, and the largest motion of a vertex along an axis; pixels, lens included in
  // `size`.
  double size() const;
  double blur() const;

 private:
  struct Vertex {
    std::array<double, 2> open, way;  // x, y at shutter open; to shutter close
    double z0, z1;
  };
  double rate(const Vertex& v, double t) const;
  double rate_time(const Vertex& v, double rate) const;
  double lens_factor(double z) const;
  double reach(const Vertex& v, double t0, double t1) const;                 // of the lens
  double margin(const Vertex& v, double t0, double t1, double width) const;  // of rounding
  // Narrows `times` to the times at which some vertex is below `side` (sign 1) or above it (sign -1) along an axis.
  void keep_side(std::size_t axis, double sign, double side, double width, Times& times) const;

  const MicroMesh& mesh_;
  bool moving_, orthographic_;
  double inverse_focus_, radius_;
  std::vector<Vertex> vertices_;
};

// A bounding polygon of a primitive: a rectangle of the tile's pixels, and the stencil values that it covers.
struct BoundingPiece {
  IntRect pixels;
  StencilReferences references;
};

// The methods of US 9626762 for cutting the bounding polygon of a moving primitive. Each appends its pieces to `out`
// and returns the number of rectangles that it tested, including rectangles outside the tile.
//
// Invariants (cited by the tests):
//   BP1  A sample that the inside test finds inside the primitive is in a piece.
//   BP2  No sample is in two pieces of one primitive: pieces overlap in space or in time, never in both.
//   BP3  No piece reaches outside `tile`, holds no pixel, or keeps a stencil value outside `times`.
//
// Brute: the rectangle of the whole motion, at all times.
std::size_t whole_motion_piece(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                               std::vector<BoundingPiece>& out);
// Timeline segments, clusters: `count` (1 to 256) equal segments of the 256 stencil values, each with the
// rectangle of its own time. The geometry is bounded over the very values that the references select, from the first
// one's earliest time to the last one's latest, so nothing can round apart.
std::size_t segment_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times, int count,
                           std::vector<BoundingPiece>& out);
// Partition, cluster-partition: the rectangle of the whole motion, cut into squares of about the primitive's own size;
// each keeps the stencil values of the times at which the moving box touches it. Those times are solutions, so they are
// widened by one stencil value at each end: there geometry and stencil may round apart.
std::size_t partition_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                             std::vector<BoundingPiece>& out);

// Interleaved: for each stencil value that samples have, the rectangle of the primitive at their times: with eight bits
// a single time, at which it stands still.
std::size_t interleaved_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                               const SampleClasses& classes, std::vector<BoundingPiece>& out);

// Number of segments of a polygon if the configuration leaves it to the unit: the primitive's motion in units of its
// own size.
int segments_for(const PrimitiveBound& bound);

}  // namespace tessera::tilecore
