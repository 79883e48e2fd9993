#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/settings.h"

namespace tessera::frontend {

// What a moving box covers of the frame: about a zonotope, the sum of segments in pixels. The first three are the box's
// own sides, which a split halves; the others are what its halves sweep as well: the way of its centre over the
// shutter, and how far lens and rounding reach in x and in y. All are scaled so that together they have the width and
// the height of the part of the bounds that lies in the frame: perspective and clipping at the near plane are in the
// bounds. Corners that are no finite numbers leave the rectangle alone.
struct ScreenShape {
  static constexpr std::size_t kSides = 6, kHalvedSides = 3;
  std::array<DVec2, kSides> sides{};

  double width() const;
  double height() const;
  double area() const;  // of the zonotope: the sum of |a x b| over pairs of segments
  // Of half the box, cut across one of its own sides.
  ScreenShape half(std::size_t side) const;
};
ScreenShape screen_shape(const MovingCorners& corners, const ScreenBounds& bounds, int frame_width, int frame_height);

// What a sub-patch is expected to cost behind the front end.
struct CostEstimate {
  double entries = 0;     // of lists
  double list_bytes = 0;  // of entries and its record, written and read
  double boxes = 0;       // that bins build of its cells and leaves
  double cycles = 0;      // of all of it
};

// Prices sub-patches and their splits, in cycles of the described machine, bytes and operations one after the other.
//
// A convex shape with bounding rectangle w x h and area A, put at random on a grid of bins with sides T and U, touches
//
//   E = A / (T U) + w / T + h / U + 1
//
// of them on average (Minkowski sum with a bin); a rectangle (w/T + 1)(h/U + 1). Each of them writes and reads an entry
// and builds the boxes of all n cells:
//
//   C(n, E) = record + E (entry + n cell)
//
// Half the box along a side s touches E' = E - b/2 bins, b the terms of E that hold s. A split gains
//
//   C(n, E) - 2 C(n/2, E') - 2 bound = n cell b/2 - entry (E - b) - record - 2 bound
//
// so what halves sweep as well (motion, lens) is paid twice by it. Not in the estimate: parts that are hidden, which
// cost a bin no more than their entry, and whose share finer sub-patches raise; halves outside the view or facing away;
// that the boxes of halves are tighter than half a box; vertices that the tessellator's cache loses.
//
// Invariants (cited by the tests):
//   SPC1  expected_bins() is the mean over all places of the bins that a zonotope touches.
//   SPC2  gain() is the difference of the costs of both ways.
//   SPC3  Where bins have nothing to build, nothing is worth a split; so where all is free.
class SplitCost {
 public:
  explicit SplitCost(const SplitPrices& prices) : prices_(prices) {}

  double expected_bins(const ScreenShape& shape) const;
  // `cells`: of the sub-patch; `moving`: its entries hold times.
  CostEstimate cost(const ScreenShape& shape, double cells, bool moving) const;
  // Cycles that halving across `side` saves, where a bound fetches `bound_bytes`.
  double gain(const ScreenShape& shape, double cells, bool moving, std::size_t side, double bound_bytes) const;

 private:
  SplitPrices prices_;
};

}  // namespace tessera::frontend
