#include "tilecore/tile_order.h"

#include <algorithm>
#include <bit>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr int kMaxSide = 1 << 15;  // places are 32 bits wide

// A curve through a square goes through its quadrants one after the other, and through each in the way of some curve.
struct Quadrant {
  std::uint8_t x, y, curve;
};
using Curve = std::array<Quadrant, 4>;
constexpr std::uint8_t kZ = 0, kHilbertCurve = 1;
// After Z, Hilbert's four curves: the basic one, transposed, transposed about the other diagonal, turned by half.
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

// The place of a cell in strips of `height` rows of `columns` cells.
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

TileOrder::TileOrder(TileSequence sequence, const binner::TileGrid& grid)
    : along_curve_(sequence == TileSequence::kMorton || sequence == TileSequence::kHilbert),
      curve_(sequence == TileSequence::kHilbert ? kHilbertCurve : kZ),
      strip_rows_(sequence == TileSequence::kStrips ? kStripRows : 1),
      columns_(grid.columns()) {
  TESSERA_CHECK(grid.columns() < kMaxSide && grid.rows() < kMaxSide, "places of tiles fit 32 bits");
  square_ = std::bit_ceil(static_cast<std::uint32_t>(std::max({grid.columns(), grid.rows(), 1})));
  std::vector<std::pair<std::uint32_t, binner::TileIndex>> places;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) places.emplace_back(place(tile), tile);
  std::sort(places.begin(), places.end());
  for (const auto& [place, tile] : places) tiles_.push_back(tile);
}

std::uint32_t TileOrder::place(binner::TileIndex tile) const {
  const int column = static_cast<int>(tile) % columns_, row = static_cast<int>(tile) / columns_;
  if (along_curve_) {
    Square square{curve_, 0, 0, square_, 0};
    while (square.side > 1) {
      std::uint32_t k = 0;
      while (!square.quadrant(k).contains(column, row)) ++k;
      square = square.quadrant(k);
    }
    return square.first;
  }
  const int height = strip_rows_, strip = row / height;
  return static_cast<std::uint32_t>((strip * columns_ + column) * height + row % height);
}

std::uint32_t TileOrder::next(const IntRect& tiles, std::uint32_t from) const {
  if (tiles.empty()) return kNever;
  if (along_curve_) return next_in_square(tiles, from, {curve_, 0, 0, square_, 0});
  return next_in_strips(tiles, from, columns_, strip_rows_);
}

}  // namespace tessera::tilecore
