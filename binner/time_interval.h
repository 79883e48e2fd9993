#pragma once

#include <algorithm>
#include <cstdint>

#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

// Time codes first..last, both included: code k stands for the times [k/256, (k+1)/256) of the shutter. Empty when
// first > last.
struct TimeInterval {
  int first = 0, last = 255;

  bool empty() const { return first > last; }
  int codes() const { return empty() ? 0 : last - first + 1; }
  TimeInterval intersect(const TimeInterval& o) const { return {std::max(first, o.first), std::min(last, o.last)}; }
  TimeInterval hull(const TimeInterval& o) const {
    if (empty()) return o;
    return o.empty() ? *this : TimeInterval{std::min(first, o.first), std::max(last, o.last)};
  }
  bool operator==(const TimeInterval&) const = default;
};
inline constexpr TimeInterval kNoTime{1, 0};

enum class Axis { kX, kY };

// Codes of the times at which the moving box may touch the strip low <= X <= high (or Y) of the screen, closed, in
// pixels. A tile's interval is the intersection of its column's and its row's.
//
// The tile frustum with time bounds of Clarberg and Burns (US 8791945) in raster space: a point right of the strip has
// xh - high * w > 0, which is linear in the point and, for a point that moves linearly, in time. The smallest value
// over the corners at key 0 and the smallest at key 1, joined by a line, bound it from below for *every* pair of points
// of the two boxes. (The line of each single corner would not: where a drawable deforms and turns at once, a vertex is
// at different places of the box at the two motion keys.)
//
// `grow` widens the strip: everything drawn lies within this many pixels of the projections. The body must satisfy
// has_hull().
TimeInterval times_in_strip(const frontend::MovingCorners& corners, Axis axis, double low, double high, double grow);

}  // namespace tessera::binner
