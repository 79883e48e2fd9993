#pragma once

#include <cstddef>
#include <cstdint>

#include "tilecore/resolve/stencil_lookup.h"

// Whole blocks amid others of their rate, by wide registers; an inner header of cubic_stencil.cpp.
namespace tessera::tilecore {

struct WideFill {
  std::uint64_t taps = 0;  // 0: nothing was done, since the instruction set in use has no registers of two pixels
  bool finite = true;      // false: some result is not
};

// Fills in out16[4*y + x] every pixel of a block that `pattern` leaves out. The kernel must have a table, and every
// pixel of the window that the pattern renders within the kernel's reach must be usable. `block` is its pixel (0, 0);
// rows are `stride` pixels apart. Nothing is clamped.
//
// Bits are those of weighted_sum() in cubic_stencil.cpp: the same sums in the same order, for two pixels at once. What
// is not rendered is not read.
WideFill fill_interior_block(Reconstruction kernel, const MirroredPattern& pattern, const Vec4* block,
                             std::ptrdiff_t stride, Vec4* out16);

}  // namespace tessera::tilecore
