#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Unchanged blocks of a tile, which are neither read nor written: the frame buffer and the records being written hold
// them since two frames ago, and the frame between is known to be the same (History::Stay).
struct UnchangedBlocks {
  IntRect blocks;                  // the tile's columns and rows, in 4x4 pixels of the frame
  std::vector<std::uint8_t> kept;  // by block, row by row
  bool any = false;

  bool at(int column, int row) const { return any && kept[blocks.index(column, row)] != 0; }
  // Whether all blocks of the tile in a rectangle are kept.
  bool all(IntRect of) const;
};

// A block at rest, and its signature, which stays in memory and is all that a kept block reads of a frame. A dithered
// block is shaded by squares of four pixels (pattern_dither.h); its taken-over pixels are not available, so each square
// has a signature of its own.
//
// Invariants (cited by the tests):
//   KB1  Equal blocks match. Of blocks that differ in their records, or in a square that is wholly shaded,
//        one in 2^24 does (with as many bits).
struct SignedBlock {
  BlockMask exists = kFullBlock;
  std::array<PixelCode, 16> codes{};
  std::array<float, 16> depth{};
  std::array<std::uint32_t, 16> surface{};
  bool operator==(const SignedBlock&) const = default;
};
struct BlockSignature {
  std::uint32_t records = 0;
  std::array<std::uint32_t, 4> squares{};  // as kSquareOrder; 24 bits each
};
// `bits`: of each part, at most 32 for records, 24 for squares.
BlockSignature signature_of(const SignedBlock& block, int bits);
// Compares the records and the squares whose existing pixels are all in `shaded`.
bool matches(const BlockSignature& a, const BlockSignature& b, BlockMask exists, BlockMask shaded);

}  // namespace tessera::tilecore
