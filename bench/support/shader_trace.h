#pragma once

#include <cstddef>

#include "bench/support/invocations.h"

namespace tessera::bench {

// Number of vector instructions of the pixel shader for one group of lanes, as the mean over groups.
struct ShaderWork {
  double arithmetic = 0;  // one for each operation on reals, whole numbers, masks and conversions, except the following
  double divisions = 0, roots = 0;
  double texel_gathers = 0;  // texels, heights and the table of sRGB codes
  double other_gathers = 0;  // vertex attributes and the environment's lobes
};

// Traces the text of the shader (tilecore/shading/lane_shader.inc and its includes) on lanes that record their
// operations, for every `stride`-th group of `lanes` (at most 16) invocations, packed as PixelShader packs them, without
// a texture unit. Equal operations count once, as a compiler merges them; unused operations do not count; min, max,
// floor and absolute value count as one each. Throws std::runtime_error if a lane's result differs from shade_point().
ShaderWork trace_shader(const CaptureInvocations& of, std::size_t lanes, std::size_t stride);

}  // namespace tessera::bench
