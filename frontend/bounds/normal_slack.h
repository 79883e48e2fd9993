#pragma once

namespace tessera::frontend {

// Double-precision cosines are off by a few 2^-53; this much is added to every squared sine and sine.
inline constexpr double kConeSlack = 1e-13;
// Tangents closer than this to parallel are left to the fallback: the domain shader's own test for irregular points
// (an angle of 1e-5, in floats) then never triggers inside a part that has a cone.
inline constexpr double kLeastSine = 0x1p-10;
// A cone whose normals floats cannot place better than this is none.
inline constexpr double kLargestNormalError = 0x1p-6;
// Smallest squared length that is not taken for zero; squares of floats' differences are far above it.
inline constexpr double kTinyLength2 = 1e-290;
// Tangents with a smaller sine between them span no plane.
inline constexpr double kLeastFrameSine = 1e-6;

}  // namespace tessera::frontend
