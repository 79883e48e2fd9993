#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Where a block of 4x4 pixels lies, and what it sees: what the next frame's reprojection asks before it takes a colour.
struct BlockRecord {
  BlockMask exists = kFullBlock;  // inside the region
  BlockMask reconstructed = 0;    // pixels that were made from others
  // One surface on a plane: value + x * by_x + y * by_y, 1/z or, without perspective, z. The lowest eight bits of the
  // gradients are 0.
  bool plane = false;
  float value = 0, by_x = 0, by_y = 0;
  // Else of each pixel, row by row; of a plane, the surface of the first; 0: nothing is seen.
  std::array<std::uint32_t, 16> surface{};
  std::array<float, 16> depth{};  // not of a plane

  bool nothing() const { return plane && surface[0] == 0; }
};

// Lossless code of the records of up to 4x4 blocks, a cell, row by row. As colours (frame_compression.h): predict, code
// what is left at the least width that holds it, keep the cell's place in memory. [assumed]
//
//   cell      8 bits, the bursts that it takes; then its blocks. One in which nothing is seen takes none: a byte of each
//             block (History) says so, too
//   block     2 bits: nothing is seen, a plane of the surface before, a plane of another (32 bits), pixels;
//             then 2 bits: no pixel was reconstructed, those of the block before, the others, 16 bits follow
//   plane     value and gradients as differences from what the plane to the left, or else above, goes on with: 6, 5 and 5
//             bits of width, then as many; the first one is predicted as 0
//   pixels    of each that exists a bit: the surface of the pixel before; else a bit: of that above; else 32 bits. Then 6
//             bits of width and the depths' differences from the plane through three neighbours of the surface, or from
//             the last pixel of it, or, of its first pixel, the depth itself in 32 bits
// Differences are those of floats as integers in the order of their values, modulo 2^32 (2^24 of gradients), zigzag.
inline constexpr int kCellSide = 4;                            // blocks
inline constexpr std::size_t kCellBytes = 16 * (16 + 16 * 8);  // of its place: what 16 blocks take without a code

// `blocks` has `columns` blocks in a row. Invariants (cited by the tests):
//   PR1  unpack_records() gives back every bit of what pack_records() was given.
//   PR2  No cell takes more than its place.
// Bytes, not yet rounded to bursts; 0: nothing is seen.
std::size_t pack_records(std::span<const BlockRecord> blocks, std::size_t columns, std::span<std::uint8_t> out);
// `blocks` say which of their pixels exist.
void unpack_records(std::span<const std::uint8_t> bytes, std::size_t columns, std::span<BlockRecord> blocks);

}  // namespace tessera::tilecore
