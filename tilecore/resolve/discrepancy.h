#pragma once

#include <cstddef>
#include <cstdint>

#include "base/enum_words.h"
#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Test whether reprojection went wrong in a block. If so its reprojected pixels are shaded in the same frame (US
// 2015/0379692 [0045]), and a disocclusion flag keeps the next frames from reusing pixels around it ([0044]).
enum class DiscrepancyCheck {
  kRendered,  // compares the rendered pixels with their reprojected colours: like with like,
              // so that texture is no discrepancy
  kOff,
};

struct DiscrepancySettings {
  DiscrepancyCheck check = DiscrepancyCheck::kRendered;
  float tolerance = 0.025f;  // [measured] relative difference of a pixel; 0.05 shimmers more than half as checkerboard
  int frames = 1;            // number of frames in which the neighbourhood is rendered fully; at most 15
};

// Difference of two linear colours between 0 and 1: the largest difference of a channel relative to the brighter
// colour, with a floor so that black is not infinitely far from nearly black. NaN differs from every colour by 1.
float relative_difference(const Vec4& a, const Vec4& b);

// The largest such difference over pixels of a block. Colours are a16[4*y + x] and b[y * b_stride + x].
float largest_difference(const Vec4* a16, const Vec4* b, std::ptrdiff_t b_stride, BlockMask pixels);

// [measured] Difference in light c, as c / (1 + c), between pixels brighter than white and other pixels of a block from
// which on the border of a highlight is shaded in full: bumps under a moving camera, worst of seven frames.
inline constexpr float kHighlightContrast = 0.1f;

// [assumed] linear light below which differences count less; a tenth of a white diffuse surface.
inline constexpr float kDifferenceFloor = 0.1f;
inline constexpr float kLargestDifference = 1e30f;  // largest difference that is distinct from infinity

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::DiscrepancyCheck> = std::to_array<std::string_view>({"rendered", "off"});

}  // namespace tessera
