#pragma once

#include <cmath>
#include <cstdint>

namespace tessera::tilecore {

// How a pixel is shaded (DeferredShader::shade()).
enum PixelRate : std::uint8_t {
  kSkipped = 0,      // its samples have no colour
  kTogether = 1,     // all samples may share invocations
  kHalvesApart = 2,  // samples in the left half do not share with those in the right
};

// For a sample at `x` of the frame.
inline bool in_right_half(float x) { return x - std::floor(x) >= 0.5f; }

}  // namespace tessera::tilecore
