#pragma once

#include <cstdint>

namespace tessera {

// Stateless random numbers: every value is a function of its coordinates, so any order of evaluation and any
// number of threads give the same image.

// Bijective 32-bit mix with full avalanche (Chris Wellons' "lowbias32", exhaustively searched constants).
constexpr std::uint32_t mix32(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

constexpr std::uint32_t hash32(std::uint32_t a, std::uint32_t b, std::uint32_t c = 0, std::uint32_t d = 0) {
  return mix32(mix32(mix32(mix32(a) + b) + c) + d);
}

// Reverses the order of the bits: the base-2 radical inverse of x, scaled by 2^32.
constexpr std::uint32_t reverse_bits32(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  x = ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
  return x;
}

// Second dimension of Sobol's sequence, scaled by 2^32: with reverse_bits32 a (0,2)-sequence in base 2
// (Kollig and Keller 2002, "Efficient multidimensional sampling").
constexpr std::uint32_t sobol2_32(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t v = 1u << 31; index != 0; index >>= 1, v ^= v >> 1)
    if (index & 1) result ^= v;
  return result;
}

}  // namespace tessera
