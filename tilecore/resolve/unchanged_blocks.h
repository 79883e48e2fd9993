#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Blocks of a tile that stay as they are: neither read nor written, as the frame buffer and the records that are
// written now hold them since two frames ago, and the frame between is known to be the same (History::Stay).
struct UnchangedBlocks {
  IntRect blocks;                  // columns and rows, in 4x4 pixels of the frame, that the tile has
  std::vector<std::uint8_t> kept;  // of each, row by row
  bool any = false;

  bool at(int column, int row) const { return any && kept[blocks.index(column, row)] != 0; }
  // Whether all blocks of a rectangle that the tile has are kept.
  bool all(IntRect of) const;
};

// A block at rest, and the signature of it that stays in memory: all that is asked of a frame for a block
// that is kept. A dithered block is shaded by squares of four pixels (pattern_dither.h); what it takes over is not at
// hand, so each square has a signature of its own.
//
// Invariants (cited by the tests):
//   KB1  Blocks that are the same match. Of others that differ in their records, or in a square that is wholly shaded,
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
// `bits`: of each part, at most 32 of records, 24 of squares.
BlockSignature signature_of(const SignedBlock& block, int bits);
// By records and by those squares of which all pixels that exist are in `shaded`.
bool matches(const BlockSignature& a, const BlockSignature& b, BlockMask exists, BlockMask shaded);

}  // namespace tessera::tilecore
