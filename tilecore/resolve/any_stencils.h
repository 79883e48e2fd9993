#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/stencil_lookup.h"

// Pixels in any surroundings, one after the other; an inner header of cubic_stencil.cpp.
namespace tessera::tilecore {

using UsableRows = std::array<std::uint16_t, kWindowSide>;

struct WindowView {
  const BlockWindow& window;
  const UsableRows& usable;

  const Vec4* at(int x, int y) const { return window.first_pixel + y * window.row_stride + x; }
};

// What a block's pixels are filled with.
struct FillPlan {
  Reconstruction kernel;
  std::optional<MirroredPattern> pattern;  // set: the tables hold for `border`
  unsigned border = 0;
};

// Fills out16[4*y + x] for `pixels`; the window has a usable pixel. False: some result is not finite.
bool fill_any(const WindowView& view, const FillPlan& plan, BlockMask pixels, Vec4* out16, ReconstructionWork& work);

}  // namespace tessera::tilecore
