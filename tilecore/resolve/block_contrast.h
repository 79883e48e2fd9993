#pragma once

#include <cstdint>
#include <limits>

#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Distance of a block's colours from the interpolation of their neighbours: the detail that stencils would miss. It is
// a byte that each fast block leaves to the next frame, whose blocks find it along their motion.
//
// Colours are taken approximately as a display shows them: by the square root, up to white.
//
// Invariants (cited by the tests):
//   BC1  A ramp of displayed colours has no contrast, a flat block none.
//   BC2  contrast_of() of a code is no less than the coded contrast; kUnknownContrast is no block's code.
//   BC3  The byte follows from the block's own pixels, and, where too few are known, from the bytes read for it.
inline constexpr std::uint8_t kUnknownContrast = 0;  // not measured

// Root mean square over pixels and channels, of displayed values between 0 and 1; a value that is not finite stands for
// unknown.
std::uint8_t contrast_code(float contrast);
float contrast_of(std::uint8_t code);

// Differences of pixels from the mean of two opposite neighbours: beside and above if all pixels are known, diagonal
// (times kDiagonal, as these neighbours are farther away) if half are. `colors` are [y * stride + x]. Of four known
// pixels only their difference from a plane is measured: `known_enough` is false.
struct MeasuredContrast {
  float contrast = 0;
  bool known_enough = true;
};
MeasuredContrast measure_contrast(const Vec4* colors, std::ptrdiff_t stride, BlockMask known,
                                  std::uint64_t& operations);

// The predicted error of reconstruction at `samples` of 16 pixels, root mean square over the block.
// [measured] at sliding noise and checkers (tests/replay/resolve_patterns_test.cpp).
float predicted_error(int samples, float contrast);

// Share of the contrast that remains when the block moves by so many pixels while the shutter is open: the attenuation
// by a box filter of patterns of up to a wavelength of some pixels.
constexpr float left_by_blur(float pixels) { return pixels > 1.0f ? 1.0f / pixels : 1.0f; }

}  // namespace tessera::tilecore
