#pragma once

#include <algorithm>
#include <vector>

#include "base/rect.h"
#include "tilecore/micro_mesh.h"
#include "tilecore/sample_pattern.h"

namespace tessera::tilecore {

// Times (as codes 0..255, t = code / 256) at which a leaf's moving box may touch a rectangle of pixels. Empty when
// first > last.
struct TimeRange {
  int first = 0, last = 255;
  bool empty() const { return first > last; }
  TimeRange intersect(const TimeRange& o) const { return {std::max(first, o.first), std::min(last, o.last)}; }
};

// An interval of a leaf's own time tau; empty when low > high.
struct LeafInterval {
  double low = 0, high = 1;
  bool empty() const { return low > high; }
};

// The frustum of a rectangle against a leaf's moving box, side by side (Clarberg and Burns, US 8791945): each face of
// the box moves linearly in tau, so each side of the rectangle leaves an interval of tau. Distances are shifted inwards
// by an error bound before the crossing is solved; that, not a nudge of the solution, is what keeps slow motion safe.
// The interval is then mapped to t and widened by one code.
//
// The two directions are independent: the blocks of a tile share the intervals of their columns and rows.
class LeafFrustum {
 public:
  // `lens_radius` in pixels per unit of the leaf's lens factor; 0 for a pinhole. A lens widens the rectangle by the
  // largest circle of confusion of the leaf.
  LeafFrustum(const MicroMesh::Leaf& leaf, bool moving, float lens_radius);

  // Columns or rows of pixels [begin, end).
  LeafInterval columns(int begin, int end) const { return touching(leaf_.x_low, leaf_.x_d_low, leaf_.x_high, leaf_.x_d_high, begin, end); }
  LeafInterval rows(int begin, int end) const { return touching(leaf_.y_low, leaf_.y_d_low, leaf_.y_high, leaf_.y_d_high, begin, end); }

  TimeRange times(const LeafInterval& columns, const LeafInterval& rows) const;

 private:
  LeafInterval touching(float face_low, float d_low, float face_high, float d_high, int begin, int end) const;

  const MicroMesh::Leaf& leaf_;
  bool moving_;
  double reach_;
};

// Samples of each block of a tile that the leaf may touch at their own time, within an interval of codes; blocks
// without any are left out. `out` is overwritten.
void touched_samples(const LeafFrustum& frustum, const TileSamples& samples, const TimeRange& within, std::vector<SampleRange>& out);

// The same as LeafFrustum::times for one rectangle.
TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_radius);

}  // namespace tessera::tilecore
