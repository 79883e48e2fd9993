#pragma once

#include <cstddef>

#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// Runs the pixel shader for `count` invocations of one draw, on SIMD lanes. All arrays reach to the next multiple of 16.
// shade_lane() is its scalar twin, with the same bits.
void shade_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                const ShadedArrays& out);

}  // namespace tessera::tilecore
