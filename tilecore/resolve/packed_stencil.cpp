#include "tilecore/resolve/packed_stencil.h"

#include "tilecore/resolve/stencil_lookup.h"

namespace tessera::tilecore {

std::optional<Stencil> table_stencil(Reconstruction kernel, BlockMask pattern, unsigned border, int pixel) {
  const auto mirrored = pattern_of(kernel, corner_of(pattern));
  if (!mirrored) return std::nullopt;
  const StencilIndexEntry entry = mirrored_entry(kernel, border, *mirrored, pixel);
  if (entry.stencil == kNoStencil) return std::nullopt;
  return stencil_of(entry);
}

StencilTableSize stencil_table_size() {
  return {generated::kStencils, generated::kStencilBits, std::size(generated::kStencilIndex)};
}

}  // namespace tessera::tilecore
