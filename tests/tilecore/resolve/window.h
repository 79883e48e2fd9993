#pragma once

#include <random>

#include "tests/support/tests.h"
#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/packed_stencil.h"
#include "tilecore/resolve/tile_border.h"

// Windows around a block for the tests of tilecore/resolve/.
namespace tessera::tilecore::windows {

inline constexpr Reconstruction kKernels[kReconstructionCount] = {
    Reconstruction::kNearest, Reconstruction::kBilinear, Reconstruction::kCubicUnscaled, Reconstruction::kCubic,
    Reconstruction::kCubicInterpolating};

using UsableRows = std::array<std::uint16_t, kWindowSide>;

inline bool is_set(const UsableRows& rows, int x, int y) { return rows[static_cast<std::size_t>(y)] >> x & 1; }

// A pattern of the block repeated over the window, cut at its borders (a sum of BorderSide); with the lines there.
inline UsableRows repeated(BlockMask pattern, unsigned border = 0, bool lines = true) {
  UsableRows rows{};
  for (int y = 0; y < kWindowSide; ++y)
    for (int x = 0; x < kWindowSide; ++x) {
      const int bx = x - kWindowMargin, by = y - kWindowMargin;
      if ((border & kLeftBorder && bx < 0) || (border & kRightBorder && bx > 3) || (border & kTopBorder && by < 0) ||
          (border & kBottomBorder && by > 3))
        continue;
      const unsigned here = (bx < 0 || bx > 3 ? 0u : border & (kLeftBorder | kRightBorder)) |
                            (by < 0 || by > 3 ? 0u : border & (kTopBorder | kBottomBorder));
      const auto rendered = static_cast<BlockMask>(pattern | border_line(pattern, lines ? here : 0u));
      if (rendered >> (4 * (by & 3) + (bx & 3)) & 1)
        rows[static_cast<std::size_t>(y)] = static_cast<std::uint16_t>(rows[static_cast<std::size_t>(y)] | 1u << x);
    }
  return rows;
}

// The rows without the pixels of `missing`, as reconstruct_block() sees them.
inline UsableRows without(UsableRows rows, BlockMask missing) {
  for (int p = 0; p < 16; ++p)
    if (missing >> p & 1) {
      auto& row = rows[static_cast<std::size_t>(p / 4 + kWindowMargin)];
      row = static_cast<std::uint16_t>(row & ~(1u << (p % 4 + kWindowMargin)));
    }
  return rows;
}

// Ten by ten pixels.
struct Window {
  std::array<Vec4, 100> colors{};
  UsableRows usable{};

  Vec4& at(int x, int y) { return colors[static_cast<std::size_t>(10 * y + x)]; }
  const Vec4& at(int x, int y) const { return colors[static_cast<std::size_t>(10 * y + x)]; }
  void fill(const std::function<Vec4(int, int)>& color) {
    for (int y = 0; y < 10; ++y)
      for (int x = 0; x < 10; ++x) at(x, y) = color(x, y);
  }
  BlockWindow view() const { return {colors.data(), 10, usable}; }
};

using Random = std::mt19937;
inline float uniform(Random& random, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(random);
}
inline int below(Random& random, int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); }
inline Vec4 random_color(Random& random) {
  return {uniform(random, -1, 4), uniform(random, -1, 4), uniform(random, 0, 1000), uniform(random, 0, 1)};
}

// The patterns of pattern_dither.h, whole or cut anywhere, or nothing regular at all.
inline UsableRows random_usable(Random& random) {
  constexpr BlockMask kPatterns[] = {kSquareOrder[0], kSquareOrder[1], kSquareOrder[2], kSquareOrder[3],
                                     kPairOrder[0],   kPairOrder[1],   kFullBlock};
  UsableRows rows = repeated(kPatterns[below(random, 7)], static_cast<unsigned>(below(random, 2) * below(random, 16)));
  switch (below(random, 4)) {
    case 0:
      break;
    case 1: {  // the frame ends somewhere
      const int right = below(random, 11), bottom = below(random, 11);
      for (int y = 0; y < 10; ++y)
        rows[static_cast<std::size_t>(y)] =
            static_cast<std::uint16_t>(y < bottom ? rows[static_cast<std::size_t>(y)] & ((1u << right) - 1) : 0u);
      break;
    }
    case 2:  // holes
      for (auto& row : rows) row = static_cast<std::uint16_t>(row & random());
      break;
    default:  // few or many, anywhere
      for (auto& row : rows)
        row = static_cast<std::uint16_t>(random() & random() & (below(random, 2) ? 0x3ffu : random()));
  }
  return rows;
}

}  // namespace tessera::tilecore::windows
