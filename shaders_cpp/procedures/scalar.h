#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "base/random.h"
#include "base/real.h"

namespace tessera::shaders {

// Functions that procedures need of a scalar type besides base/real.h, for float and double. SIMD lanes have them in
// procedures-inl.h with the same bits as float, intervals in frontend/bounds/enclosure_functions.h.

// Gradients of the noise at lattice points: two numbers in [-1, 1) from the halves of a hash.
struct LatticeGradient {
  float x, y;
};
inline LatticeGradient lattice_gradient(std::int32_t x, std::int32_t y) {
  const std::uint32_t h = hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  return {static_cast<float>(h & 0xFFFFu) * 0x1p-15f - 1.0f, static_cast<float>(h >> 16) * 0x1p-15f - 1.0f};
}
// A number in [-1, 1) at a point of the lattice in space.
inline float lattice_value(std::int32_t x, std::int32_t y, std::int32_t z) {
  return static_cast<float>(
             hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z)) >> 8) *
             0x1p-23f -
         1.0f;
}

}  // namespace tessera::shaders
