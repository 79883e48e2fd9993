#include "tilecore/tile_order.h"

#include <algorithm>
#include <bit>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr int kMaxSide = 1 << 15;  // places are 32 bits wide

// Every second bit, from bit 0 on.
std::uint32_t spread(std::uint32_t bits) {
  std::uint32_t x = bits;
  x = (x | x << 8) & 0x00FF00FFu;
  x = (x | x << 4) & 0x0F0F0F0Fu;
  x = (x | x << 2) & 0x33333333u;
  return (x | x << 1) & 0x55555555u;
}
std::uint32_t gather(std::uint32_t bits) {
  std::uint32_t x = bits & 0x55555555u;
  x = (x | x >> 1) & 0x33333333u;
  x = (x | x >> 2) & 0x0F0F0F0Fu;
  x = (x | x >> 4) & 0x00FF00FFu;
  return (x | x >> 8) & 0x0000FFFFu;
}

// In the square of `size` at (x, y) whose first place is `first`.
std::uint32_t next_in_square(const IntRect& cells, std::uint32_t from, int x, int y, std::uint32_t size,
                             std::uint32_t first) {
  const int side = static_cast<int>(size);
  if (x >= cells.x1 || y >= cells.y1 || x + side <= cells.x0 || y + side <= cells.y0) return TileOrder::kNever;
  if (first + (size * size - 1) < from) return TileOrder::kNever;
  if (first >= from && x >= cells.x0 && y >= cells.y0) return first;
  const std::uint32_t half = size / 2;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t found = next_in_square(cells, from, x + static_cast<int>((k & 1) * half),
                                               y + static_cast<int>((k >> 1) * half), half, first + k * half * half);
    if (found != TileOrder::kNever) return found;
  }
  return TileOrder::kNever;
}

// In strips of `height` rows of `columns` cells.
std::uint32_t next_in_strips(const IntRect& cells, std::uint32_t from, int columns, int height) {
  const std::uint32_t strip_cells = static_cast<std::uint32_t>(columns) * static_cast<std::uint32_t>(height);
  const int first = static_cast<int>(from / strip_cells);
  const auto place = [&](int strip, int column, int row) {
    return static_cast<std::uint32_t>(strip) * strip_cells +
           static_cast<std::uint32_t>(column) * static_cast<std::uint32_t>(height) +
           static_cast<std::uint32_t>(row - strip * height);
  };
  for (int strip = std::max(first, cells.y0 / height); strip * height < cells.y1; ++strip) {
    const int top = std::max(cells.y0, strip * height), bottom = std::min(cells.y1, (strip + 1) * height);
    if (strip > first) return place(strip, cells.x0, top);
    const auto within = static_cast<int>(from % strip_cells);
    const int column = within / height, row = strip * height + within % height;
    if (column < cells.x0) return place(strip, cells.x0, top);
    if (column < cells.x1 && row < bottom) return place(strip, column, std::max(row, top));
    if (column + 1 < cells.x1) return place(strip, column + 1, top);
  }
  return TileOrder::kNever;
}

}  // namespace

TileOrder::TileOrder(TileSequence sequence, const binner::TileGrid& grid, int group_side)
    : sequence_(sequence),
      side_(group_side),
      columns_(grid.columns()),
      group_columns_((grid.columns() + group_side - 1) / group_side),
      group_rows_((grid.rows() + group_side - 1) / group_side) {
  TESSERA_CHECK(grid.columns() < kMaxSide && grid.rows() < kMaxSide, "places of tiles fit 32 bits");
  square_ = std::bit_ceil(static_cast<std::uint32_t>(std::max({group_columns_, group_rows_, 1})));
  std::vector<std::pair<std::uint32_t, binner::TileIndex>> places;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) places.emplace_back(place(tile), tile);
  std::sort(places.begin(), places.end());
  for (const auto& [place, tile] : places) tiles_.push_back(tile);
}

std::uint32_t TileOrder::group_place(Cell group) const {
  if (sequence_ == TileSequence::kMorton)
    return spread(static_cast<std::uint32_t>(group.column)) | spread(static_cast<std::uint32_t>(group.row)) << 1;
  const int height = sequence_ == TileSequence::kStrips ? kStripRows : 1, strip = group.row / height;
  return static_cast<std::uint32_t>((strip * group_columns_ + group.column) * height + group.row % height);
}

TileOrder::Cell TileOrder::group_at(std::uint32_t place) const {
  if (sequence_ == TileSequence::kMorton)
    return {static_cast<int>(gather(place)), static_cast<int>(gather(place >> 1))};
  const int height = sequence_ == TileSequence::kStrips ? kStripRows : 1, at = static_cast<int>(place);
  const int strip = at / (group_columns_ * height);
  return {at / height % group_columns_, strip * height + at % height};
}

std::uint32_t TileOrder::next_group(const IntRect& groups, std::uint32_t from) const {
  if (sequence_ == TileSequence::kMorton) return next_in_square(groups, from, 0, 0, square_, 0);
  return next_in_strips(groups, from, group_columns_, sequence_ == TileSequence::kStrips ? kStripRows : 1);
}

std::uint32_t TileOrder::place(binner::TileIndex tile) const {
  const int column = static_cast<int>(tile) % columns_, row = static_cast<int>(tile) / columns_;
  const std::uint32_t group = group_place({column / side_, row / side_});
  return group * static_cast<std::uint32_t>(side_ * side_) +
         static_cast<std::uint32_t>(row % side_ * side_ + column % side_);
}

std::uint32_t TileOrder::next(const IntRect& tiles, std::uint32_t from) const {
  if (tiles.empty()) return kNever;
  if (side_ == 1) return next_group(tiles, from);
  const auto area = static_cast<std::uint32_t>(side_ * side_);
  const IntRect groups{tiles.x0 / side_, tiles.y0 / side_, (tiles.x1 + side_ - 1) / side_,
                       (tiles.y1 + side_ - 1) / side_};
  for (std::uint32_t group = next_group(groups, from / area); group != kNever; group = next_group(groups, group + 1)) {
    const Cell at = group_at(group);
    const IntRect within = IntRect{tiles.x0 - at.column * side_, tiles.y0 - at.row * side_,
                                   tiles.x1 - at.column * side_, tiles.y1 - at.row * side_}
                               .intersect({0, 0, side_, side_});
    const std::uint32_t found = next_in_strips(within, group == from / area ? from % area : 0, side_, 1);
    if (found != kNever) return group * area + found;
  }
  return kNever;
}

}  // namespace tessera::tilecore
