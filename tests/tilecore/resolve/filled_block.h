#pragma once

#include "tests/support/tests.h"
#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore::windows {

// Result of reconstruct_block() for a block.
struct Filled {
  std::array<Vec4, 16> color{};
  BlockMask unfilled = 0;
  ReconstructionWork work;

  const Vec4& at(int p) const { return color[static_cast<std::size_t>(p)]; }
};
inline Filled fill(Reconstruction kernel, const BlockWindow& window, BlockMask missing) {
  Filled f;
  f.color.fill(Vec4(-77.0f));
  f.unfilled = reconstruct_block(kernel, window, missing, f.color.data(), f.work);
  return f;
}

}  // namespace tessera::tilecore::windows
