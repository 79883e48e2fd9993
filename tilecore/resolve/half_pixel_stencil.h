#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/vec.h"
#include "tilecore/resolve/packed_stencil.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Blocks of 4x4 pixels at 32 samples (US 2015/0379692 [0064]: "32 samples for a 16 pixel 4x4 tile. Appropriate pre-computed
// stencils would be added"): the left and the right half of each pixel, a lattice of 8x4 whose columns lie half a pixel
// apart. Of its 32 places 16 or 24 are rendered, the others are weighted sums of those of the same block:
//   c = sum of w(dx, dy) * colour / sum of w(dx, dy),  w(dx, dy) = k(s dx / 2) * k(s dy),  s = sqrt(8)/3,
// over 5x5 places of the lattice, with k of Mitchell and Netravali, B = C = 1/3; s scales a distance of one pixel, which is
// that of the samples, as 2/3 does for the sqrt(2) pixels between 8 of 16 (cubic_stencil.h). What lies outside the block
// has no weight: a block that is rendered at 32 has an edge, and its neighbours mostly have none.

// Bit 8*y + 2*x + h is half h (0 left, 1 right) of pixel (x, y) of the block.
using HalfMask = std::uint32_t;
inline constexpr HalfMask kAllHalves = 0xffffffffu;
constexpr HalfMask half_bit(int x, int y, int half) { return 1u << (8 * (y & 3) + 2 * (x & 3) + half); }

// The places that are rendered: 16 (a quincunx, the other half of every pixel in the next frame), 24 (all but every second
// place of every second row, in four frames) or 32.
//
//   HS1  Exactly `groups` bits are set; every place is rendered groups/8 times in any four frames in a row, and in any two
//        once at least.
HalfMask half_pattern(int groups, std::uint32_t frame);

// Offsets in places of the lattice; weights of 8 bits that sum to a power of two, rounded after they were normalised, each
// within a unit of the exact one. Nothing for a place that the pattern renders. `pattern`: one of half_pattern().
//
//   HS2  A place that the pattern leaves out has a stencil of at most 14 taps.
std::optional<Stencil> half_stencil(HalfMask pattern, int place);

// Whether `place` can be made from `usable` places of the pattern: the sum of their weights is at least half of the sum of
// their magnitudes.
bool half_is_reconstructible(HalfMask usable, int place);

// colors32[8*y + 2*x + h]; only usable places are read. By the table where all places of its stencil are usable, else by
// the kernel over those that are. half_is_reconstructible() must hold. Adds to `taps`.
//
//   HS3  A flat colour comes back as itself, bit for bit.
Vec3 reconstruct_half(HalfMask pattern, HalfMask usable, int place, const Vec3* colors32, std::uint64_t& taps);

}  // namespace tessera::tilecore
