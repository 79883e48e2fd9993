#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "tilecore/resolve/stencil_lookup.h"

// Blocks amid others of their rate: stencils known when this is compiled; an inner header of cubic_stencil.cpp.
namespace tessera::tilecore {

struct InteriorBlock {
  MirroredPattern pattern;  // every pixel of the window that it renders within the kernel's reach must be usable
  BlockMask missing;        // of the pixels that the pattern leaves out: those to fill
  bool whole;               // all of them are
  const Vec4* first;        // pixel (0, 0) of the block
  std::ptrdiff_t stride;    // of rows, in pixels
  Vec4* out16;              // [4*y + x]
};

struct InteriorFill {
  std::uint64_t taps = 0;
  bool finite = true;  // false: some result is not
};

// The kernel must have a table. What the pattern does not render is not read.
//
// Whole blocks are filled two pixels at a time where the instruction set in use has registers of as many: the same sums
// in the same order, and so the same bits.
InteriorFill fill_interior(Reconstruction kernel, const InteriorBlock& block);

}  // namespace tessera::tilecore
