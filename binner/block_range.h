#pragma once

#include <cstdint>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::binner {

// The blocks of 8x8 (or 16x16) pixels that a sub-patch may touch, as its record stores them: first column and row
// modulo 16. In a tile so large that this position is ambiguous, the range stands for the whole tile.
//
// Invariant (cited by the tests):
//   BR1  Within a tile, pixels() holds every pixel of it that the closed bounds touch.
struct BlockRange {
  static constexpr int kPeriod = 16;
  static constexpr std::uint8_t kAny = 7;  // as a number of columns or rows: no limit

  // First column and row modulo kPeriod; number of columns and rows less one, or kAny.
  std::uint8_t column = 0, row = 0, more_columns = kAny, more_rows = kAny;
  bool wide = false;  // blocks of 16x16, not 8x8
  bool operator==(const BlockRange&) const = default;

  int side() const { return wide ? 16 : 8; }

  // Chooses the block size that leaves fewer of columns and rows unlimited, and 8x8 when both leave as many.
  static BlockRange of(const frontend::ScreenBounds& bounds);

  // `tile`: pixels of the frame. A range that holds no pixel of it, as happens with lists of tile groups, stands for
  // the whole tile.
  IntRect pixels(const IntRect& tile) const;
};

}  // namespace tessera::binner
