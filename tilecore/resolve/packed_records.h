#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Place and surfaces of a block of 4x4 pixels, which the next frame's reprojection checks before it takes a colour.
struct BlockRecord {
  BlockMask exists = kFullBlock;  // inside the region
  BlockMask reconstructed = 0;    // pixels that were reconstructed from others
  // One surface on a plane: value + x * by_x + y * by_y, 1/z or, without perspective, z. The lowest eight bits of the
  // gradients are 0.
  bool plane = false;
  float value = 0, by_x = 0, by_y = 0;
  // Otherwise of each pixel, row by row; for a plane, the first is its surface; 0 means no surface.
  std::array<std::uint32_t, 16> surface{};
  std::array<float, 16> depth{};  // unused for a plane

  bool nothing() const { return plane && surface[0] == 0; }
};

// Lossless code of the records of up to 4x4 blocks, a cell, row by row. As for colours (frame_compression.h): predict,
// code the residuals at the least width that holds them, keep the cell's place in memory. [assumed]
//
//   cell      8 bits, the bursts that it takes; then its blocks. A cell without surfaces takes none: a byte of each
//             block (History) tells so, too
//   block     2 bits: no surface, a plane of the previous surface, a plane of another (32 bits), pixels;
//             then 2 bits: no reconstructed pixel, the mask of the previous block, its complement, 16 bits follow
//   plane     value and gradients as differences from the continued plane to the left, or else above: 6, 5 and 5
//             bits of width, then as many; the first one is predicted as 0
//   pixels    for each that exists a bit: same surface as the pixel before; else a bit: as the one above; else 32 bits. Then 6
//             bits of width and the depths' differences from the plane through three neighbours of the surface, or from
//             the last pixel of it, or, of its first pixel, the depth itself in 32 bits
// Differences are taken of floats as integers in the order of their values, modulo 2^32 (2^24 for gradients), zigzag.
inline constexpr int kCellSide = 4;                            // blocks
inline constexpr std::size_t kCellBytes = 16 * (16 + 16 * 8);  // of its place: 16 blocks without a code

// `blocks` has `columns` blocks in a row. Invariants (cited by the tests):
//   PR1  unpack_records() returns every bit of the input of pack_records().
//   PR2  No cell takes more than its place.
// Returns the bytes, not yet rounded to bursts; 0 if no surface is seen.
std::size_t pack_records(std::span<const BlockRecord> blocks, std::size_t columns, std::span<std::uint8_t> out);
// `blocks` must give the pixels that exist.
void unpack_records(std::span<const std::uint8_t> bytes, std::size_t columns, std::span<BlockRecord> blocks);

}  // namespace tessera::tilecore
