#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/stencil_lookup.h"

// The two ways to fill pixels; an inner header of cubic_stencil.cpp.
namespace tessera::tilecore {

// ---- Pixels in any surroundings, one at a time (any_stencils_kernel.cpp) -----------------------------------------

using UsableRows = std::array<std::uint16_t, kWindowSide>;

struct WindowView {
  const BlockWindow& window;
  const UsableRows& usable;

  const Vec4* at(int x, int y) const { return window.first_pixel + y * window.row_stride + x; }
};

// Method of filling a block's pixels.
struct FillPlan {
  Reconstruction kernel;
  std::optional<MirroredPattern> pattern;  // if set, the tables hold for `border`
  unsigned border = 0;
};

// Fills out16[4*y + x] for `pixels`; the window must have a usable pixel. Returns false if a result is not finite.
bool fill_any(const WindowView& view, const FillPlan& plan, BlockMask pixels, Vec4* out16, ReconstructionWork& work);

// ---- Blocks amid others of their rate: stencils are known at compile time (interior_stencils_kernel.cpp) ---------

struct InteriorBlock {
  MirroredPattern pattern;  // every pixel of the window that it renders within the kernel's reach must be usable
  BlockMask missing;        // the pixels to fill, all of them left out by the pattern
  bool whole;               // `missing` holds all pixels that the pattern leaves out
  const Vec4* first;        // pixel (0, 0) of the block
  std::ptrdiff_t stride;    // of rows, in pixels
  Vec4* out16;              // [4*y + x]
};

struct InteriorFill {
  std::uint64_t taps = 0;
  bool finite = true;  // false: a result is not finite
};

// The kernel must have a table. Pixels that the pattern does not render are not read.
//
// Whole blocks are filled two pixels at a time if the instruction set in use has registers for as many: the same sums
// in the same order, and so the same bits.
InteriorFill fill_interior(Reconstruction kernel, const InteriorBlock& block);

}  // namespace tessera::tilecore
