#pragma once

#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {

// Checkerboard rendering as a baseline: checkerboard_mask() says which half of the pixels is shaded; here the others
// get the mean of their usable neighbours above, left, right and below. (Published renderers also move the previous
// frame's pixel along and clamp it to those neighbours, and filter along edges by object id: El Mansouri, "Rendering
// Rainbow Six Siege", GDC 2016; Wihlidal, "4K checkerboard in Battlefield 1 and Mass Effect Andromeda", GDC 2017.)
struct CheckerboardWork {
  std::uint64_t pixels = 0;             // filled
  std::uint64_t taps = 0;               // neighbours read
  std::uint64_t non_finite_pixels = 0;  // neighbours left out since they hold NaN or infinity
};

// Fills the pixels of `missing` in out16[4*y + x]; returns those that have no usable neighbour. Usable bits of missing
// pixels are ignored.
[[nodiscard]] BlockMask reconstruct_checkerboard(const BlockWindow& window, BlockMask missing, Vec4* out16,
                                                 CheckerboardWork& work);

}  // namespace tessera::tilecore
