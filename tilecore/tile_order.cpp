#include "tilecore/tile_order.h"

#include <algorithm>
#include <bit>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr int kMaxSide = 1 << 15;  // places are 32 bits wide

// A curve through a square goes through its quadrants one after the other, and through each as another curve does.
struct Quadrant {
  std::uint8_t x, y, curve;
};
using Curve = std::array<Quadrant, 4>;
constexpr std::uint8_t kZ = 0, kHilbertCurve = 1;
// Hilbert's: as it is, transposed, transposed about the other diagonal, turned by half.
constexpr std::array<Curve, 5> kCurves = {{
    {{{0, 0, kZ}, {1, 0, kZ}, {0, 1, kZ}, {1, 1, kZ}}},
    {{{0, 0, 2}, {0, 1, 1}, {1, 1, 1}, {1, 0, 3}}},
    {{{0, 0, 1}, {1, 0, 2}, {1, 1, 2}, {0, 1, 4}}},
    {{{1, 1, 4}, {0, 1, 3}, {0, 0, 3}, {1, 0, 1}}},
    {{{1, 1, 3}, {1, 0, 4}, {0, 0, 4}, {0, 1, 2}}},
}};

// A square of cells and the places that a curve gives them.
struct Square {
  std::uint8_t curve;
  int x = 0, y = 0;
  std::uint32_t side, first = 0;

  Square quadrant(std::uint32_t k) const {
    const Quadrant& q = kCurves[curve][k];
    const std::uint32_t half = side / 2;
    return {q.curve, x + q.x * static_cast<int>(half), y + q.y * static_cast<int>(half), half, first + k * half * half};
  }
  bool contains(int column, int row) const {
    return column >= x && row >= y && column < x + static_cast<int>(side) && row < y + static_cast<int>(side);
  }
};

std::uint32_t next_in_square(const IntRect& cells, std::uint32_t from, const Square& square) {
  const int side = static_cast<int>(square.side);
  const IntRect common = cells.intersect({square.x, square.y, square.x + side, square.y + side});
  if (common.empty() || square.first + (square.side * square.side - 1) < from) return TileOrder::kNever;
  if (square.side == 1) return square.first;
  for (std::uint32_t k = 0; k < 4; ++k)
    if (const std::uint32_t found = next_in_square(cells, from, square.quadrant(k)); found != TileOrder::kNever)
      return found;
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
    : along_curve_(sequence == TileSequence::kMorton || sequence == TileSequence::kHilbert),
      curve_(sequence == TileSequence::kHilbert ? kHilbertCurve : kZ),
      strip_rows_(sequence == TileSequence::kStrips ? kStripRows : 1),
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
  if (along_curve_) {
    Square square{curve_, 0, 0, square_, 0};
    while (square.side > 1) {
      std::uint32_t k = 0;
      while (!square.quadrant(k).contains(group.column, group.row)) ++k;
      square = square.quadrant(k);
    }
    return square.first;
  }
  const int height = strip_rows_, strip = group.row / height;
  return static_cast<std::uint32_t>((strip * group_columns_ + group.column) * height + group.row % height);
}

TileOrder::Cell TileOrder::group_at(std::uint32_t place) const {
  if (along_curve_) {
    Square square{curve_, 0, 0, square_, 0};
    while (square.side > 1) square = square.quadrant((place - square.first) / (square.side * square.side / 4));
    return {square.x, square.y};
  }
  const int height = strip_rows_, at = static_cast<int>(place), strip = at / (group_columns_ * height);
  return {at / height % group_columns_, strip * height + at % height};
}

std::uint32_t TileOrder::next_group(const IntRect& groups, std::uint32_t from) const {
  if (along_curve_) return next_in_square(groups, from, {curve_, 0, 0, square_, 0});
  return next_in_strips(groups, from, group_columns_, strip_rows_);
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
