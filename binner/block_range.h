#pragma once

#include <cstdint>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

// Which blocks of 8x8 pixels, or 16x16, a sub-patch may touch, as its record keeps them: where they begin repeats every 16
// blocks. Where a tile is so large that they would be in it twice, all of it stands for them.
//
// Invariant (cited by the tests):
//   BR1  Within a tile, pixels() holds every pixel of it that the closed bounds touch.
struct BlockRange {
  static constexpr int kPeriod = 16;
  static constexpr std::uint8_t kAny = 7;  // as a number of columns or rows: no limit

  // First column and row modulo kPeriod; how many less one, or kAny.
  std::uint8_t column = 0, row = 0, more_columns = kAny, more_rows = kAny;
  bool wide = false;  // blocks of 16x16, not 8x8
  bool operator==(const BlockRange&) const = default;

  int side() const { return wide ? 16 : 8; }

  // With the blocks that leave fewer columns and rows without limit, the smaller ones if that is the same.
  static BlockRange of(const frontend::ScreenBounds& bounds);

  // `tile`: pixels of the frame. A range that has none of them, as groups of tiles may bring, stands for all.
  IntRect pixels(const IntRect& tile) const;
};

}  // namespace tessera::binner
