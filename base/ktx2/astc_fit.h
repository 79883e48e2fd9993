#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/ktx2/astc_numbers.h"

// The colours of ETC1S blocks as two ASTC endpoints and a weight for each selector.
namespace tessera::ktx2 {

// The ranges of a fit. Ranges that are used together fill the 128 bits of a block.
struct AstcFitRanges {
  AstcRange weights, endpoints;
};
inline constexpr AstcFitRanges kRgbFit{astc_range(12), astc_range(256)};      // RGB, one plane
inline constexpr AstcFitRanges kRgbaFit{astc_range(12), astc_range(96)};      // RGBA, one plane
inline constexpr AstcFitRanges kTwoPlaneFit4{astc_range(4), astc_range(48)};  // RGBA; alpha has its own weights:
inline constexpr AstcFitRanges kTwoPlaneFit3{astc_range(3),
                                             astc_range(128)};  // fewer weight levels leave finer endpoints
inline constexpr AstcFitRanges kTwoPlaneFit2{astc_range(2), astc_range(256)};
inline constexpr AstcFitRanges kGreyAlphaFit{astc_range(5), astc_range(256)};  // luminance; alpha with its own weights

struct AstcFit {
  std::array<std::array<std::uint8_t, 2>, 3> endpoints{};  // by channel: values of the low and the high end
  std::array<std::uint8_t, 4> weights{};                   // by selector
  std::array<std::int32_t, 4> errors{};                    // by selector: sum of squares over the channels
};

// Returns the fit with the least squared error among the tried ones, for the colours of the selectors whose bits are
// set in `used` (at least one). The first `channels` (1 or 3) of `colors` count. The colours of a block lie on a line,
// except where they are clamped to 8 bits. The search tries several weights for the outermost colours, since steps
// between ASTC's weights differ in size, finds the endpoints by least squares and then moves them by steps.
AstcFit fit_astc(const std::array<std::array<std::uint8_t, 3>, 4>& colors, unsigned used, std::size_t channels,
                 const AstcFitRanges& ranges);

}  // namespace tessera::ktx2
