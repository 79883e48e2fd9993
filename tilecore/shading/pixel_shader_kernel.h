#pragma once

#include <cstddef>

#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// Runs the pixel shader for `count` invocations of one draw, on SIMD lanes. All arrays reach to the next multiple of 16.
// shade_lane() is its scalar twin, with the same bits.
void shade_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                const ShadedArrays& out);
// The same for draws whose material has layers; shade_draw() calls it for them.
void shade_layered_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                        const ShadedArrays& out);

// Copies the valid lines (not negative) that differ from the line before them, in order; returns their number. `out`
// has room for count + 16.
std::size_t distinct_neighbours(const std::int32_t* lines, std::size_t count, std::int32_t* out);

}  // namespace tessera::tilecore
