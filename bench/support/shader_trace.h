#pragma once

#include <cstddef>

#include "bench/support/invocations.h"

namespace tessera::bench {

// Vector instructions of the pixel shader for one group of lanes, the mean over groups.
struct ShaderWork {
  double arithmetic = 0;  // one for each operation but those below: of reals, whole numbers, masks, conversions
  double divisions = 0, roots = 0;
  double texel_gathers = 0;  // texels, heights and the table of sRGB codes
  double other_gathers = 0;  // vertex attributes and the environment's lobes
};

// The text of the shader (tilecore/shading/lane_shader.inc and all that it includes) on lanes that write down what they
// do, for every `stride`-th group of `lanes` (at most 16) invocations, packed as PixelShader packs them, without a
// texture unit. What a compiler finds to be the same is one operation, what nothing depends on is none; min, max, floor
// and absolute values are one each. Throws std::runtime_error where a lane is not shaded as shade_point() does.
ShaderWork trace_shader(const CaptureInvocations& of, std::size_t lanes, std::size_t stride);

}  // namespace tessera::bench
