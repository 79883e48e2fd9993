#pragma once

#include <array>
#include <cstddef>

// The kinds of UASTC blocks ("UASTC LDR 4x4 Texture Specification").
namespace tessera::ktx2 {

// A mode's number is a prefix code in the low bits; hints for transcoders follow up to bit `start`, where the pattern
// or the second plane's channel is and behind it the endpoints. Digits of endpoints come first, packed as plain
// numbers, then their bits; weights follow, the first one of each subset without its high bit, which is 0.
struct UastcMode {
  unsigned code, code_bits, start;
  int components, subsets, planes, weight_levels, endpoint_levels;
};
inline constexpr std::array<UastcMode, 19> kModes = {{{1, 4, 19, 3, 1, 1, 16, 192},
                                                      {53, 6, 21, 3, 1, 1, 4, 256},
                                                      {29, 5, 20, 3, 2, 1, 8, 16},
                                                      {3, 5, 20, 3, 3, 1, 4, 12},
                                                      {19, 5, 20, 3, 2, 1, 4, 40},
                                                      {11, 5, 20, 3, 1, 1, 8, 256},
                                                      {27, 5, 20, 3, 1, 2, 4, 160},
                                                      {7, 5, 20, 3, 2, 1, 4, 40},
                                                      {23, 5, 5, 4, 1, 1, 0, 0},  // a solid colour
                                                      {15, 5, 28, 4, 2, 1, 4, 16},
                                                      {2, 3, 20, 4, 1, 1, 16, 48},
                                                      {0, 2, 19, 4, 1, 2, 4, 48},
                                                      {6, 3, 20, 4, 1, 1, 8, 192},
                                                      {31, 5, 28, 4, 1, 2, 2, 256},
                                                      {13, 5, 28, 4, 1, 1, 4, 256},
                                                      {5, 7, 30, 2, 1, 1, 16, 256},
                                                      {21, 6, 29, 2, 2, 1, 4, 256},
                                                      {37, 6, 29, 2, 1, 2, 4, 256},
                                                      {9, 4, 19, 3, 1, 1, 32, 32}}};
inline constexpr std::size_t kSolidMode = 8, kOtherPatternsMode = 7, kReservedMode = kModes.size();

}  // namespace tessera::ktx2
