#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/ktx2/astc_numbers.h"

// The colours of ETC1S blocks as two ASTC endpoints and a weight for each selector.
namespace tessera::ktx2 {

// The ranges of a fit; those that go together fill a block's 128 bits.
struct AstcFitRanges {
  AstcRange weights, endpoints;
};
inline constexpr AstcFitRanges kRgbFit{astc_range(12), astc_range(256)};       // RGB, one plane
inline constexpr AstcFitRanges kRgbaFit{astc_range(12), astc_range(96)};       // RGBA, one plane
inline constexpr AstcFitRanges kTwoPlaneFit4{astc_range(4), astc_range(48)};   // RGBA, alpha with its own weights:
inline constexpr AstcFitRanges kTwoPlaneFit3{astc_range(3), astc_range(128)};  // the fewer of them, the finer the ends
inline constexpr AstcFitRanges kTwoPlaneFit2{astc_range(2), astc_range(256)};
inline constexpr AstcFitRanges kGreyAlphaFit{astc_range(5), astc_range(256)};  // luminance; alpha with its own weights

struct AstcFit {
  std::array<std::array<std::uint8_t, 2>, 3> endpoints{};  // by channel: values of the low and the high end
  std::array<std::uint8_t, 4> weights{};                   // by selector
  std::array<std::int32_t, 4> errors{};                    // by selector: sum of squares over the channels
};

// The fit of least squared error, among what is tried, to the colours of those selectors that `used` has the bit of; at
// least one. `channels` (1 or 3) of `colors` count. The colours of a block lie on a line but for the ends of the range
// of 8 bits; weights of the outermost ones are tried from several places, since steps between ASTC's weights are not
// all alike, with the ends by least squares, then moved by steps.
AstcFit fit_astc(const std::array<std::array<std::uint8_t, 3>, 4>& colors, unsigned used, std::size_t channels,
                 const AstcFitRanges& ranges);

}  // namespace tessera::ktx2
