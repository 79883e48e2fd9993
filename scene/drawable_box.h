#pragma once

#include <cstddef>
#include <limits>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// A box along the axes of its space; a box without points is empty.
struct SpaceBox {
  DVec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(low.x <= high.x && low.y <= high.y && low.z <= high.z); }
  DVec3 middle() const { return 0.5 * (low + high); }
  DVec3 half() const { return 0.5 * (high - low); }
  void add(const DVec3& p) { low = glm::min(low, p), high = glm::max(high, p); }
  void add(const SpaceBox& other) { low = glm::min(low, other.low), high = glm::max(high, other.high); }
};

// The box of a drawable's points at a motion key, in its own space, with the points of all its instances. Displacement
// is left out. A procedure is sampled: between the samples its surface may reach slightly beyond the box.
SpaceBox own_box(const PosedDrawable& drawable, std::size_t key);

// The box around such a box in world space, displacement included. Empty where a transform yields infinite or NaN
// coordinates.
SpaceBox world_box(const PosedDrawable& drawable, std::size_t key, const SpaceBox& own);

}  // namespace tessera::scene
