#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/ktx2/ktx2_writer.h"
#include "base/ktx2/texel_block.h"

namespace tessera::ktx2 {

inline std::size_t block_columns(const LevelToWrite& level) { return static_cast<std::size_t>((level.width + 3) / 4); }
inline std::size_t block_rows(const LevelToWrite& level) { return static_cast<std::size_t>((level.height + 3) / 4); }

// The texels of a block; those beyond the level repeat its last column and row.
inline TexelBlock get_block(const LevelToWrite& level, std::size_t column, std::size_t row) {
  const auto width = static_cast<std::size_t>(level.width), height = static_cast<std::size_t>(level.height);
  TexelBlock block;
  for (std::size_t t = 0; t < 16; ++t) {
    const std::size_t x = std::min(4 * column + t % 4, width - 1), y = std::min(4 * row + t / 4, height - 1);
    std::copy_n(level.texels.begin() + static_cast<std::ptrdiff_t>(4 * (y * width + x)), 4, block[t].begin());
  }
  return block;
}

// Blocks of a level, row by row.
inline std::vector<TexelBlock> level_blocks(const LevelToWrite& level) {
  std::vector<TexelBlock> blocks;
  blocks.reserve(block_columns(level) * block_rows(level));
  for (std::size_t row = 0; row < block_rows(level); ++row)
    for (std::size_t column = 0; column < block_columns(level); ++column)
      blocks.push_back(get_block(level, column, row));
  return blocks;
}

}  // namespace tessera::ktx2
