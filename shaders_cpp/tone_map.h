#pragma once

#include "base/image.h"
#include "base/vec.h"

namespace tessera::shaders {

// Khronos PBR Neutral tone mapper: base colours below 0.8 keep their hue and value, highlights compress towards white.
// Input: linear light >= 0 (negative and NaN components count as 0); output in [0, 1], linear.
Vec3 tone_map(Vec3 linear);

// The light that tone_map() maps to `mapped`, whose components are in [0, 1): its inverse in closed form, up to
// rounding. For a `mapped` that no light gives, the largest component is kept and negative components become 0.
Vec3 inverse_tone_map(Vec3 mapped);

// A linear image (3 or more channels, the first three used) as 8-bit sRGB: exposure, tone map, transfer function.
Image8 to_display(const Image& linear, float exposure);

}  // namespace tessera::shaders
