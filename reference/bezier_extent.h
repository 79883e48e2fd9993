#pragma once

#include <array>
#include <cstddef>

#include "reference/sample_region.h"
#include "scene/tessellation_pattern.h"

namespace tessera::reference {

// Bounds of the vertices of a Bezier patch, or of a part of its grid, on the axes of a region at all times of the
// shutter: the hull of the part's own control points (Ramshaw 1989, blossoming), widened by the displacement.
class BezierExtent {
 public:
  using Points = std::array<DVec3, 16>;

  // `points` and `to_space`, at both motion keys: control points, and the transform into the scene's space. Displaced
  // vertices are at most `reach` from the surface.
  BezierExtent(const SampleRegion& region, const std::array<Points, 2>& points, const std::array<DMat4, 2>& to_space,
               double reach);

  SampleRegion::Extent over(const scene::ParameterRange& range) const;

 private:
  struct Net {
    std::array<double, 16> value;
    double slack;
  };
  std::array<std::array<Net, SampleRegion::kAxes>, 2> nets_;
};

}  // namespace tessera::reference
