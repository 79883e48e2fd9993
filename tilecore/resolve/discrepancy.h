#pragma once

#include <cstddef>
#include <cstdint>

#include "base/enum_words.h"
#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// How a block finds out that advection went wrong in it. What it finds keeps the next frames from advecting around it.
enum class DiscrepancyCheck {
  kRendered,    // what advection would have given for the rendered pixels, against what they are.
                // Deviation from the note and better: it compares like with like, so texture is no discrepancy, and the
                // block is fetched anyway
  kNeighbours,  // advected pixels against the range of their rendered neighbours in the block, as published
  kOff,
};

struct DiscrepancySettings {
  DiscrepancyCheck check = DiscrepancyCheck::kRendered;
  float tolerance = 0.025f;  // [measured] relative difference of a pixel; 0.05 shimmers more than half as checkerboard
  bool same_frame = true;    // the block's advected pixels are then shaded, too
  int frames = 1;            // for which the neighbourhood is rendered fully; at most 15
};

// Difference of two linear colours between 0 and 1: of the channel that differs most, relative to the brighter colour,
// with a floor so that black is not infinitely far from nearly black. NaN differs from everything by 1.
float relative_difference(const Vec4& a, const Vec4& b);

// The largest of that over pixels of a block. Colours are a16[4*y + x] and b[y * b_stride + x].
float largest_difference(const Vec4* a16, const Vec4* b, std::ptrdiff_t b_stride, BlockMask pixels);

// [assumed] linear light below which differences count less; a tenth of a white diffuse surface.
inline constexpr float kDifferenceFloor = 0.1f;
inline constexpr float kLargestDifference = 1e30f;  // that is told from infinity

// Whether the advected pixels of a block stand out of their rendered neighbours above, left, right and below in it, on
// average by more than the tolerance. Colours are [4*y + x]; pixels without rendered neighbours do not vote.
bool stands_out(const Vec4* colors, BlockMask advected, BlockMask rendered, float tolerance);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::DiscrepancyCheck> = std::to_array<std::string_view>({"rendered",
                                                                                                "neighbours", "off"});

}  // namespace tessera
