#include "binner/block_range.h"
#include "tests/support/tests.h"

namespace tessera::binner::block_range_test {
namespace {

frontend::ScreenBounds bounds_of(float x0, float y0, float x1, float y1) {
  return {.x0 = x0, .y0 = y0, .x1 = x1, .y1 = y1, .grow = 0, .near_z = 1, .far_z = 2, .crosses_near = false};
}

// Bounds, and a tile that they touch, perhaps with its edge alone.
struct Case {
  frontend::ScreenBounds bounds;
  IntRect tile;
};
Case random_case(test::Random& random) {
  // Half of the coordinates lie on edges of blocks.
  const auto coordinate = [&](float low, float high) {
    const float at = random.uniform(low, high);
    return random.coin() ? at : std::round(at / 8) * 8;
  };
  const int x = random.integer(-300, 4000), y = random.integer(-300, 4000);
  const IntRect tile{x, y, x + random.integer(1, 256), y + random.integer(1, 256)};
  const float x0 = coordinate(static_cast<float>(x - 150), static_cast<float>(tile.x1)),
              y0 = coordinate(static_cast<float>(y - 150), static_cast<float>(tile.y1));
  return {bounds_of(x0, y0, x0 + coordinate(0, 150), y0 + coordinate(0, 150)), tile};
}

// Pixels of a tile, of `left`, that the closed bounds touch and the range leaves out.
int missing(const Case& c, const IntRect& left) {
  int count = 0;
  for (int y = c.tile.y0; y < c.tile.y1; ++y)
    for (int x = c.tile.x0; x < c.tile.x1; ++x) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const bool touched = c.bounds.x0 <= fx + 1 && c.bounds.x1 >= fx && c.bounds.y0 <= fy + 1 && c.bounds.y1 >= fy;
      if (touched && !(x >= left.x0 && x < left.x1 && y >= left.y0 && y < left.y1)) ++count;
    }
  return count;
}

TEST(BlockRange, BR1HoldsEveryPixelOfTheTileThatTheBoundsTouch) {
  test::Random random(5);
  int cut = 0, wide = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Case c = random_case(random);
    const BlockRange range = BlockRange::of(c.bounds);
    const IntRect pixels = range.pixels(c.tile);
    ASSERT_FALSE(pixels.empty());
    ASSERT_EQ(pixels.intersect(c.tile), pixels);
    ASSERT_EQ(missing(c, pixels), 0) << trial;
    cut += pixels == c.tile ? 0 : 1;
    wide += pixels != c.tile && range.wide ? 1 : 0;
  }
  EXPECT_GT(cut, 5000);
  EXPECT_GT(wide, 1000);
}

// Bounds taken as open ones lose the pixels before an edge that they begin on.
TEST(BlockRangeTwin, BoundsThatAreNotClosedLosePixels) {
  test::Random random(5);
  int lost = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Case c = random_case(random);
    Case open = c;
    open.bounds.x0 += 1.0f / 64;
    open.bounds.y0 += 1.0f / 64;
    lost += missing(c, BlockRange::of(open.bounds).pixels(c.tile)) > 0 ? 1 : 0;
  }
  EXPECT_GT(lost, 100);
}

TEST(BlockRange, UnboundedRangesHoldTheWholeTile) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  const IntRect tile{64, 32, 96, 64};
  EXPECT_EQ(BlockRange{}.pixels(tile), tile);
  for (const auto& bounds : {bounds_of(-kInfinity, -kInfinity, kInfinity, kInfinity), bounds_of(kNan, kNan, kNan, kNan),
                             bounds_of(-1e30f, -1e30f, 1e30f, 1e30f), bounds_of(1e30f, 1e30f, 1e30f, 1e30f)})
    EXPECT_EQ(BlockRange::of(bounds), BlockRange{});
  // One axis may have one alone.
  EXPECT_EQ(BlockRange::of(bounds_of(70, -1e9f, 75, 1e9f)).pixels(tile), (IntRect{64, 32, 80, 64}));
}

TEST(BlockRange, PlacesRepeatAndLargeTilesHoldSeveral) {
  const BlockRange range = BlockRange::of(bounds_of(17, 1, 23, 7));  // columns 2, rows 0 of blocks of 8x8
  EXPECT_FALSE(range.wide);
  EXPECT_EQ(range.pixels({0, 0, 32, 32}), (IntRect{16, 0, 24, 8}));
  EXPECT_EQ(range.pixels({1280, 256, 1312, 288}), (IntRect{1296, 256, 1304, 264}));
  EXPECT_EQ(range.pixels({0, 0, 256, 256}), (IntRect{0, 0, 256, 256})) << "twice in it";
  EXPECT_EQ(range.pixels({32, 0, 64, 32}), (IntRect{32, 0, 64, 8})) << "no column of it";
}

}  // namespace
}  // namespace tessera::binner::block_range_test
