#pragma once

#include <cmath>
#include <cstdint>

namespace tessera::tilecore {

// What of a pixel's samples is shaded, and which of them share invocations (DeferredShader::shade()).
enum PixelRuns : std::uint8_t {
  kSkipped = 0,      // its samples have no colour
  kTogether = 1,     // all may share
  kHalvesApart = 2,  // those in the left half do not share with those in the right
  kLeftHalf = 3,     // those in the right half are skipped
  kRightHalf = 4,
  kByCell = 5,  // samples share with those of any other such pixel that see the same shading cell
};

// Of a sample at `x` of the frame.
inline bool in_right_half(float x) { return x - std::floor(x) >= 0.5f; }

}  // namespace tessera::tilecore
