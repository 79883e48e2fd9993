#pragma once

#include <cstddef>

#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// The alpha of `count` points of one draw (of one patch, if it has grids) on SIMD lanes. All arrays reach to the next
// multiple of 16. Its scalar twin is lane_alpha(), with the same bits.
void alpha_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                float* alpha);

}  // namespace tessera::tilecore
