#pragma once

#include <array>
#include <cstdint>

#include "base/check.h"
#include "base/enum_words.h"
#include "base/random.h"

namespace tessera::tilecore {

// The pixels of a block that each frame renders. Paragraphs of US 2015/0379692 and their places here:
//   [0028]         blocks of 4x4, as in all of its figures; "16x16, or other size" saves less
//   [0033] [0060]  rates of 4*s samples, made of s squares: 4, 8 and 16 of 4x4; a threshold of speed for each
//                  (rate_selector.h)
//   [0034] [0040]  a modulo-k counter, every pixel once in k frames, or by chance: here
//   [0043]         "other ratios" of advected and rendered pixels: resolve.advected_pixels, 8 or 12 of 16
//   [0044] [0045]  a discrepancy that the next frame uses, and the same frame: discrepancy.h
//   [0053] [0062]  stencils by pixel and sampling mask, a count, weights of 8 bits, offsets of 3: packed_stencil.h
//   [0064]         stencils confined to a tile (tile_border.h); 32 samples on 16 pixels: resolve.supersampling
//   [0073] [0074]  stereo; a focus, which may move here: foveation.h

// The rendered pixels of a 4x4 block: bit 4*y + x is pixel (x, y) of the block.
using BlockMask = std::uint16_t;
inline constexpr BlockMask kFullBlock = 0xffff;

// kCounter: the frame number picks the pattern. kSeeded: a hash of seed and frame picks it, without memory, so it does
// not limit how long a pixel may stay unrendered. kOff: always the pattern of frame 0.
enum class DitherOrder { kCounter, kSeeded, kOff };

struct DitherSettings {
  DitherOrder order = DitherOrder::kCounter;
  std::uint32_t seed = 0;
};

// The sparse square {0,2}x{0,2} shifted by (x, y), each 0 or 1: the four possible sets of four samples in a block.
constexpr BlockMask sparse_square(int x, int y) { return static_cast<BlockMask>(0x0505u << (x + 4 * y)); }

// Squares in the order in which the counter takes them. Two frames in a row are diagonal neighbours where they can be:
// (0, 1) and (2, 3) together are a quincunx lattice. No cyclic order of the four squares has more diagonal steps than
// two.
inline constexpr std::array<BlockMask, 4> kSquareOrder = {sparse_square(0, 0), sparse_square(1, 1), sparse_square(1, 0),
                                                          sparse_square(0, 1)};

// Pairs of squares for eight samples: diagonal ones, so that the samples are a quincunx lattice, every missing pixel
// has samples on all four sides, and the two patterns are each other's complement. Pairs that make rows or columns have
// the same number of samples, but lines twice as far apart in one direction: over sinusoids of 6 to 16 pixels in all
// directions they leave 1.7 to 2 times the error [measured].
inline constexpr std::array<BlockMask, 2> kPairOrder = {
    static_cast<BlockMask>(sparse_square(0, 0) | sparse_square(1, 1)),
    static_cast<BlockMask>(sparse_square(1, 0) | sparse_square(0, 1))};

// Four samples of a moving block that takes over the others: one in each row and column. Pixels that stop being visible
// along a row, at an edge that a surface draws before it, then have a witness in that row (discrepancy.h). Squares
// leave every second row without one.
constexpr BlockMask one_in_each_row(unsigned shift) {
  unsigned mask = 0;
  for (unsigned y = 0; y < 4; ++y) mask |= 1u << (4 * y + (2 * y + (y >> 1) + shift) % 4);
  return static_cast<BlockMask>(mask);
}
inline constexpr std::array<BlockMask, 4> kWitnessOrder = {one_in_each_row(0), one_in_each_row(2), one_in_each_row(1),
                                                           one_in_each_row(3)};

// Pixels of a block to render at `rate` samples per block: 4, 8 or 16 (checked). All blocks of a frame and rate
// share a pattern, so that samples are evenly spaced across blocks.
//
// Invariants (cited by the tests):
//   PD1  exactly `rate` bits are set; four are a sparse square, or with `witnesses` one in each row and column, eight a
//        pair of squares;
//   PD2  with kCounter every pixel is rendered rate/4 times in any four frames in a row, and at least once in any
//        ceil(16/rate), across the wrap of the frame number too, as long as `witnesses` does not change.
inline BlockMask dither_mask(int rate, std::uint32_t frame, const DitherSettings& settings, bool witnesses = false) {
  TESSERA_CHECK(rate == 4 || rate == 8 || rate == 16, "a block is rendered at 4, 8 or 16 samples");
  if (rate == 16) return kFullBlock;
  // 2^32 is a multiple of the period, so the frame number may wrap.
  const std::uint32_t step = settings.order == DitherOrder::kSeeded ? hash32(settings.seed, frame, 0, 2)
                             : settings.order == DitherOrder::kOff  ? 0
                                                                    : frame;
  return rate == 4 ? (witnesses ? kWitnessOrder : kSquareOrder)[step % 4] : kPairOrder[step % 2];
}

// Half the pixels, alternating from frame to frame: the pixels that checkerboard rendering shades.
constexpr BlockMask checkerboard_mask(std::uint32_t frame) { return kPairOrder[frame % 2]; }

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::DitherOrder> = std::to_array<std::string_view>({"counter", "seeded", "off"});

}  // namespace tessera
