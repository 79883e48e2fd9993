#include "tilecore/resolve/unchanged_blocks.h"

#include <algorithm>
#include <cstddef>
#include <span>

#include "base/crc64.h"

namespace tessera::tilecore {
namespace {

constexpr int kSquareBits = 24, kRecordBits = 32;

std::uint32_t low_bits(std::uint64_t hash, int bits) {
  return static_cast<std::uint32_t>(hash & ((std::uint64_t{1} << bits) - 1));
}

}  // namespace

bool UnchangedBlocks::all(IntRect of) const {
  const IntRect mine = of.intersect(blocks);
  for (int row = mine.y0; row < mine.y1; ++row)
    for (int column = mine.x0; column < mine.x1; ++column)
      if (!at(column, row)) return false;
  return true;
}

BlockSignature signature_of(const SignedBlock& block, int bits) {
  BlockSignature out;
  Crc64 records;
  records.add_value(block.exists);
  records.add_values(std::span<const float>(block.depth));
  records.add_values(std::span<const std::uint32_t>(block.surface));
  out.records = low_bits(records.value(), std::min(bits, kRecordBits));
  for (std::size_t square = 0; square < kSquareOrder.size(); ++square) {
    Crc64 colors;
    for (std::size_t p = 0; p < 16; ++p)
      if ((block.exists & kSquareOrder[square] & 1u << p) != 0)
        colors.add_values(std::span<const std::uint16_t>(block.codes[p]));
    out.squares[square] = low_bits(colors.value(), std::min(bits, kSquareBits));
  }
  return out;
}

bool matches(const BlockSignature& a, const BlockSignature& b, BlockMask exists, BlockMask shaded) {
  bool same = a.records == b.records;
  for (std::size_t square = 0; square < kSquareOrder.size(); ++square)
    if ((kSquareOrder[square] & exists & ~shaded) == 0) same = same && a.squares[square] == b.squares[square];
  return same;
}

}  // namespace tessera::tilecore
