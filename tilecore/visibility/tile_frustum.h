#pragma once

#include <span>

#include "base/rect.h"
#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// Times at which the samples of a rectangle of pixels may meet a leaf: the frustum of the rectangle against the leaf's
// moving box, one side at a time (Clarberg and Burns, US 8791945). Each face of the box moves linearly in the leaf's
// time tau, so each side of the rectangle leaves an interval of tau. Distances are shifted inwards by an error bound
// before the crossing is solved; that, not a nudge of the solution, keeps slow motion safe. The interval is mapped to t
// and widened by one stencil value.
//
// `lens_scale`: largest |(u, v)| of a sample, 0 for a pinhole. A lens widens the rectangle by the leaf's circle of
// confusion, to the hull over both extreme lens points.
TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_scale);

// The same for many leaves, several at a time, with the same bits; `out` has room for as many.
void touching_times(std::span<const MicroMesh::Leaf> leaves, const IntRect& pixels, bool moving, float lens_scale,
                    std::span<TimeRange> out);

}  // namespace tessera::tilecore
