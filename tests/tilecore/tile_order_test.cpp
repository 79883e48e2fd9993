#include "tilecore/tile_order.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::tile_order_test {
namespace {

constexpr TileSequence kSequences[] = {TileSequence::kRows, TileSequence::kStrips, TileSequence::kMorton,
                                       TileSequence::kHilbert};

binner::TileGrid grid_of(int columns, int rows) { return {columns * 8, rows * 8, 8, 8}; }

std::uint32_t search(const TileOrder& order, const binner::TileGrid& grid, const IntRect& tiles, std::uint32_t from) {
  for (const binner::TileIndex tile : order.tiles()) {
    const int column = static_cast<int>(tile) % grid.columns(), row = static_cast<int>(tile) / grid.columns();
    if (tiles.contains(column, row) && order.place(tile) >= from) return order.place(tile);
  }
  return TileOrder::kNever;
}

TEST(TileOrder, OT1EveryTileComesOnceByRisingPlace) {
  for (const auto& [columns, rows] : {std::pair{1, 1}, {7, 5}, {40, 23}, {3, 17}, {1, 9}})
    for (const TileSequence sequence : kSequences) {
      const binner::TileGrid grid = grid_of(columns, rows);
      const TileOrder order(sequence, grid);
      std::vector<binner::TileIndex> tiles = order.tiles();
      for (std::size_t k = 1; k < tiles.size(); ++k) ASSERT_LT(order.place(tiles[k - 1]), order.place(tiles[k]));
      std::sort(tiles.begin(), tiles.end());
      ASSERT_EQ(tiles.size(), grid.tile_count());
      for (binner::TileIndex t = 0; t < tiles.size(); ++t) ASSERT_EQ(tiles[t], t);
    }
}

TEST(TileOrder, OT2TheNextTileOfARectangleEqualsASearch) {
  test::Random random(7);
  for (const auto& [columns, rows] : {std::pair{7, 5}, {13, 21}, {1, 9}})
    for (const TileSequence sequence : kSequences) {
      const binner::TileGrid grid = grid_of(columns, rows);
      const TileOrder order(sequence, grid);
      const std::uint32_t last = order.place(order.tiles().back());
      for (int n = 0; n < 200; ++n) {
        const auto pick = [&](int end) { return static_cast<int>(random.uniform(0, static_cast<float>(end) + 0.99f)); };
        const int x0 = pick(columns - 1), y0 = pick(rows - 1);
        const IntRect tiles{x0, y0, x0 + pick(columns - x0), y0 + pick(rows - y0)};
        const auto from = static_cast<std::uint32_t>(pick(static_cast<int>(last) + 2));
        ASSERT_EQ(order.next(tiles, from), search(order, grid, tiles, from))
            << columns << "x" << rows << " " << word(sequence) << " from " << from;
      }
    }
}

TEST(TileOrder, TwinTheNextTileOfAnotherOrderDiffersFromASearch) {
  const binner::TileGrid grid = grid_of(8, 8);
  const TileOrder rows(TileSequence::kRows, grid), morton(TileSequence::kMorton, grid);
  bool differs = false;
  for (std::uint32_t from = 0; from < 64; ++from)
    differs = differs || rows.next({2, 1, 5, 6}, from) != search(morton, grid, {2, 1, 5, 6}, from);
  EXPECT_TRUE(differs);
}

TEST(TileOrder, SequencesAreAsDrawn) {
  using Tiles = std::vector<binner::TileIndex>;
  EXPECT_EQ(TileOrder(TileSequence::kRows, grid_of(3, 2)).tiles(), (Tiles{0, 1, 2, 3, 4, 5}));
  // 0 1 4 5      0 3 4 5
  // 2 3 6 7      1 2 7 6
  EXPECT_EQ(TileOrder(TileSequence::kMorton, grid_of(4, 2)).tiles(), (Tiles{0, 1, 4, 5, 2, 3, 6, 7}));
  EXPECT_EQ(TileOrder(TileSequence::kHilbert, grid_of(2, 2)).tiles(), (Tiles{0, 2, 3, 1}));
  // Two columns, ten rows: eight down, the next column, then the two rows that are left.
  EXPECT_EQ(TileOrder(TileSequence::kStrips, grid_of(2, 10)).tiles(),
            (Tiles{0, 2, 4, 6, 8, 10, 12, 14, 1, 3, 5, 7, 9, 11, 13, 15, 16, 18, 17, 19}));
}

TEST(TileOrder, HilbertNeverJumps) {
  const TileOrder order(TileSequence::kHilbert, grid_of(16, 16));
  for (std::size_t k = 1; k < order.tiles().size(); ++k) {
    const int a = static_cast<int>(order.tiles()[k - 1]), b = static_cast<int>(order.tiles()[k]);
    ASSERT_EQ(std::abs(a % 16 - b % 16) + std::abs(a / 16 - b / 16), 1);
  }
}

}  // namespace
}  // namespace tessera::tilecore::tile_order_test
