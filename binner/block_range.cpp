#include "binner/block_range.h"

#include <algorithm>
#include <cmath>

namespace tessera::binner {
namespace {

struct Blocks {
  std::uint8_t first = 0, more = BlockRange::kAny;
};

Blocks blocks_of(float low, float high, int side) {
  constexpr double kFarAway = 1 << 24;  // beyond it a coordinate does not fit an int: the range is unlimited
  const double from = static_cast<double>(low) / side, to = static_cast<double>(high) / side;
  if (!(from > -kFarAway && to < kFarAway && to - from < BlockRange::kAny)) return {};
  // Bounds are closed: bounds that begin on a block's edge also touch the block before it.
  const int first = static_cast<int>(std::ceil(from)) - 1, last = static_cast<int>(std::floor(to));
  if (last - first >= BlockRange::kAny) return {};
  return {static_cast<std::uint8_t>(first & (BlockRange::kPeriod - 1)), static_cast<std::uint8_t>(last - first)};
}

struct Pixels {
  int first, last;  // excluded
};

Pixels within(const Blocks& blocks, int side, int low, int high) {
  const Pixels all{low, high};
  if (blocks.more == BlockRange::kAny) return all;
  const int width = (blocks.more + 1) * side, repeats = BlockRange::kPeriod * side;
  // The first repetition that ends behind `low`.
  const int ends = blocks.first * side + width, offset = ((ends - low) % repeats + repeats) % repeats;
  const int last = low + (offset == 0 ? repeats : offset), first = last - width;
  if (first >= high || first + repeats < high) return all;
  return {std::max(first, low), std::min(last, high)};
}

}  // namespace

BlockRange BlockRange::of(const frontend::ScreenBounds& bounds) {
  const auto with = [&](bool sixteen) {
    const int side = BlockRange{.wide = sixteen}.side();
    const Blocks x = blocks_of(bounds.x0, bounds.x1, side), y = blocks_of(bounds.y0, bounds.y1, side);
    return BlockRange{x.first, y.first, x.more, y.more, sixteen};
  };
  const auto limits = [](const BlockRange& range) { return (range.more_columns != kAny) + (range.more_rows != kAny); };
  const BlockRange fine = with(false), coarse = with(true);
  return limits(coarse) > limits(fine) ? coarse : fine;
}

IntRect BlockRange::pixels(const IntRect& tile) const {
  const Pixels x = within({column, more_columns}, side(), tile.x0, tile.x1),
               y = within({row, more_rows}, side(), tile.y0, tile.y1);
  return {x.first, y.first, x.last, y.last};
}

}  // namespace tessera::binner
