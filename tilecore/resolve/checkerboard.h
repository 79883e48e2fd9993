#pragma once

#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {

// Checkerboard rendering as a baseline: checkerboard_mask() says which half of the pixels is shaded; here the others
// get the mean of their neighbours above, left, right and below, those that are usable. Published renderers also have
// the previous frame, which shaded just the missing half: they take its pixel, moved along, clamped to the range of the
// four neighbours so that it cannot ghost (El Mansouri, "Rendering Rainbow Six Siege", GDC 2016; Wihlidal, "4K
// checkerboard in Battlefield 1 and Mass Effect Andromeda", GDC 2017). Both are here; their filters along edges by
// object id are not.
struct CheckerboardWork {
  std::uint64_t pixels = 0;             // filled
  std::uint64_t taps = 0;               // neighbours read
  std::uint64_t history_pixels = 0;     // of `pixels`: the previous frame's pixel was taken
  std::uint64_t non_finite_pixels = 0;  // neighbours and history pixels left out since they hold NaN or infinity
};

// The previous frame's pixels for a block, moved to where they are now.
struct CheckerboardHistory {
  const Vec4* color16 = nullptr;  // [4*y + x]; only those of `valid` are read
  BlockMask valid = 0;
};

// Fills the pixels of `missing` in out16[4*y + x]; returns those that have no usable neighbour. Usable bits of missing
// pixels are ignored. A pixel with history, whose neighbours are all unusable, is not filled: nothing vouches for it.
[[nodiscard]] BlockMask reconstruct_checkerboard(const BlockWindow& window, BlockMask missing,
                                                 const CheckerboardHistory& history, Vec4* out16,
                                                 CheckerboardWork& work);

}  // namespace tessera::tilecore
