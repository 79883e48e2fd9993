#pragma once

#include <cstddef>
#include <cstdint>

#include "tilecore/resolve/advection.h"

// An inner header of advection.cpp.
namespace tessera::tilecore {

// Texels `above` and the next one, and the two below them; weights of all but the first, and not 0.
struct FourTexels {
  std::ptrdiff_t above;
  float w1, w2, w3;
};

// The mean of four texels that all have the pixel's patch, no depth further from its than `limit` (finite), and finite
// colours; false: they have not, and `out` stays.
bool fetch_agreeing_texels(const HistoryView& history, const FourTexels& texels, std::uint32_t patch, float depth,
                           float limit, Vec4* out);

}  // namespace tessera::tilecore
