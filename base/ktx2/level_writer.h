#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/ktx2/container.h"
#include "base/ktx2/etc1s.h"
#include "base/ktx2/texel_block.h"
#include "base/parallel.h"

namespace tessera::ktx2 {

// Bytes of a block in memory; 0 for a target without blocks.
constexpr std::size_t block_bytes_of(BasisTarget target) { return target == BasisTarget::kRgba32 ? 0 : 16; }

// The texels of a block; texels beyond the level repeat its last column and row.
inline TexelBlock get_block(const BasisLevel& level, std::size_t column, std::size_t row) {
  const auto width = static_cast<std::size_t>(level.width), height = static_cast<std::size_t>(level.height);
  TexelBlock block;
  for (std::size_t t = 0; t < 16; ++t) {
    const std::size_t x = std::min(4 * column + t % 4, width - 1), y = std::min(4 * row + t / 4, height - 1);
    std::copy_n(level.texels.begin() + static_cast<std::ptrdiff_t>(4 * (y * width + x)), 4, block[t].begin());
  }
  return block;
}

// Copies the part of a block that lies inside the level.
inline void put_block(const TexelBlock& texels, std::size_t column, std::size_t row, BasisLevel& level) {
  const auto width = static_cast<std::size_t>(level.width), height = static_cast<std::size_t>(level.height);
  for (std::size_t y = 4 * row; y < std::min(4 * row + 4, height); ++y)
    for (std::size_t x = 4 * column; x < std::min(4 * column + 4, width); ++x)
      std::copy_n(texels[4 * (y % 4) + x % 4].begin(), 4,
                  level.texels.begin() + static_cast<std::ptrdiff_t>(4 * (y * width + x)));
}

// Makes a level's memory and calls make_block(index of the block, its bytes, texels to fill) for every block, in any
// order and on any thread.
template <class MakeBlock>
void write_level(const ContainerLevel& source, std::size_t block_bytes, BasisLevel& level,
                 const MakeBlock& make_block) {
  level.width = static_cast<int>(source.width);
  level.height = static_cast<int>(source.height);
  level.blocks.resize(static_cast<std::size_t>(source.block_count()) * block_bytes);
  level.texels.resize(std::size_t{4} * source.width * source.height);
  parallel_for(source.rows(), [&](std::size_t row) {
    for (std::size_t column = 0; column < source.columns(); ++column) {
      const std::size_t index = row * source.columns() + column;
      TexelBlock texels;
      make_block(index, std::span<std::uint8_t>(level.blocks).subspan(index * block_bytes, block_bytes), texels);
      put_block(texels, column, row, level);
    }
  });
}

// Slices of a level of ETC1S blocks; the alpha slice is empty without alpha.
struct Etc1sLevel {
  std::span<const Etc1sBlock> color, alpha;
};
void write_etc1s_level(const Etc1sCodebooks& books, const Etc1sLevel& blocks, const ContainerLevel& source,
                       BasisTarget target, bool srgb, BasisLevel& level);
// Bytes of working memory besides the level.
std::uint64_t etc1s_working_bytes(BasisTarget target, bool alpha, std::uint64_t block_count);

}  // namespace tessera::ktx2
