#pragma once

#include <array>
#include <cstdint>

namespace tessera::ktx2 {

// 4x4 texels RGBA8, row by row from the top left.
using TexelBlock = std::array<std::array<std::uint8_t, 4>, 16>;

// A number of `bits` bits, 4 to 8, widened to 8 bits: its top bits are repeated below it.
constexpr int widen_bits(int value, int bits) { return (value << (8 - bits)) | (value >> (2 * bits - 8)); }

}  // namespace tessera::ktx2
