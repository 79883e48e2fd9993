#pragma once

#include <array>
#include <cstddef>

#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// World places of the surface points of `count` invocations of one draw, on SIMD lanes: the points that shade_draw()
// shades. All arrays reach to the next multiple of 16.
void place_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const std::array<float*, 3>& place);

}  // namespace tessera::tilecore
