#pragma once

#include <algorithm>

#include "base/rect.h"
#include "tilecore/micro_mesh.h"

namespace tessera::tilecore {

// Times (as codes 0..255, t = code / 256) at which a leaf's moving box may touch a rectangle of pixels. Empty when
// first > last.
struct TimeRange {
  int first = 0, last = 255;
  bool empty() const { return first > last; }
  TimeRange intersect(const TimeRange& o) const { return {std::max(first, o.first), std::min(last, o.last)}; }
};

// The frustum of a rectangle against a moving box, side by side (Clarberg and Burns, US 8791945): each face of the box
// moves linearly in the leaf's own time tau, so each side of the rectangle leaves an interval of tau. Distances are
// shifted inwards by an error bound before the crossing is solved; that, not a nudge of the solution, is what keeps
// slow motion safe. The interval is then mapped to t and widened by one code.
//
// `lens_radius` in pixels per unit of the leaf's lens factor; 0 for a pinhole. A lens widens the rectangle by the
// largest circle of confusion of the leaf.
TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_radius);

}  // namespace tessera::tilecore
