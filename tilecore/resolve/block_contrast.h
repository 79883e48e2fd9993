#pragma once

#include <cstdint>
#include <limits>

#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// How far a block's colours are from what lies between their neighbours: what stencils would miss of it. A byte that
// each fast block leaves to the next frame, whose blocks find it where they come from.
//
// Colours are taken as a display shows them, about: by the square root, up to white.
//
// Invariants (cited by the tests):
//   BC1  A ramp of displayed colours has no contrast, a flat block none.
//   BC2  contrast_of() of a code is no less than what was coded; kUnknownContrast is no block's code.
//   BC3  The byte follows from the block's own pixels, and, where too few are known, from the bytes read for it.
inline constexpr std::uint8_t kUnknownContrast = 0;  // nobody looked

// Root mean square over pixels and channels, of displayed values between 0 and 1; not finite: nothing is known.
std::uint8_t contrast_code(float contrast);
float contrast_of(std::uint8_t code);

// Differences of pixels from the mean of two neighbours opposite each other: beside and above where all pixels are
// known, diagonally (times kDiagonal, as their neighbours are farther away) where half are. `colors` are
// [y * stride + x]. Of four there is only how they differ from a plane: `known_enough` is false.
struct MeasuredContrast {
  float contrast = 0;
  bool known_enough = true;
};
MeasuredContrast measure_contrast(const Vec4* colors, std::ptrdiff_t stride, BlockMask known,
                                  std::uint64_t& operations);

// The predicted error of reconstruction at `samples` of 16 pixels, root mean square over the block.
// [measured] at sliding noise and checkers (tests/replay/resolve_patterns_test.cpp).
float predicted_error(int samples, float contrast);

// Share of a contrast that a shutter leaves in which the block moves by so many pixels: that of a box over patterns of
// up to a wavelength of some pixels.
constexpr float left_by_blur(float pixels) { return pixels > 1.0f ? 1.0f / pixels : 1.0f; }

}  // namespace tessera::tilecore
