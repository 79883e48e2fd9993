// Tiles that published GPUs choose.
#include "hardware/tile_rules.h"
#include "base/error.h"
#include "tests/support/tests.h"

namespace tessera::hardware::tile_rules_test {
namespace {

TilePixels mali(std::string_view product, std::vector<int> color_bytes, int samples = 1) {
  return mali_tile(product, {color_bytes, samples});
}

TEST(TileRules, MaliTilesAreFullUpToTheBitsThatArmPublishes) {
  struct Row {
    const char* product;
    int side, bits;
  };
  for (const Row& row :
       {Row{"G71", 16, 128},  Row{"G31", 16, 256},  Row{"G51", 16, 256},  Row{"G52", 16, 256},  Row{"G57", 16, 256},
        Row{"G68", 16, 256},  Row{"G72", 16, 256},  Row{"G76", 16, 256},  Row{"G77", 16, 256},  Row{"G78", 16, 256},
        Row{"G310", 32, 256}, Row{"G510", 32, 256}, Row{"G610", 32, 256}, Row{"G615", 32, 256}, Row{"G620", 32, 256},
        Row{"G625", 32, 256}, Row{"G710", 32, 256}, Row{"G715", 32, 256}, Row{"G720", 32, 256}, Row{"G725", 32, 256},
        Row{"G1", 32, 256}}) {
    const TilePixels full{row.side, row.side}, half{row.side, row.side / 2};
    EXPECT_EQ(mali(row.product, {row.bits / 8}), full) << row.product;
    EXPECT_EQ(mali(row.product, {row.bits / 8, 4}), half) << row.product << ": beyond them tiles shrink";
  }
}

TEST(TileRules, MaliCountsEverySample) {
  EXPECT_EQ(mali("G720", {4}), (TilePixels{64, 64}));
  EXPECT_EQ(mali("G720", {8}), (TilePixels{64, 64})) << "64 bits";
  EXPECT_EQ(mali("G720", {4}, 4), (TilePixels{64, 32}));
  EXPECT_EQ(mali("G720", {4, 4, 4}), (TilePixels{64, 32})) << "12 bytes take 16";
  EXPECT_EQ(mali("G71", {4}, 16), (TilePixels{8, 8}));
  EXPECT_THROW(mali("G71", {16, 16, 16, 16, 16, 16, 16, 16}, 4), UsageError);
  EXPECT_THROW(mali("G99", {4}), UsageError);
  EXPECT_EQ(mali_products().size(), 22u);
}

TEST(TileRules, AppleTilesHaveThreeSizes) {
  const auto apple = [](std::vector<int> color_bytes, int samples) { return apple_tile({color_bytes, samples}); };
  EXPECT_EQ(apple({4, 4}, 1), (TilePixels{32, 32}));
  EXPECT_EQ(apple({4, 4}, 4), (TilePixels{32, 32}));
  EXPECT_EQ(apple({16, 16, 4}, 1), (TilePixels{32, 16}));
  EXPECT_EQ(apple({16, 16, 4}, 2), (TilePixels{16, 16}));
  EXPECT_THROW(apple({64, 4}, 1), UsageError) << "more than 64 bytes of a sample";
}

TEST(TileRules, V3dHalvesItsTiles) {
  const auto v3d = [](int version, std::vector<int> color_bytes, int samples) {
    return v3d_tile(version, {color_bytes, samples});
  };
  EXPECT_EQ(v3d(4, {4}, 1), (TilePixels{64, 64}));
  EXPECT_EQ(v3d(4, {4}, 4), (TilePixels{32, 32}));
  EXPECT_EQ(v3d(4, {8}, 1), (TilePixels{64, 32}));
  EXPECT_EQ(v3d(4, {4, 4}, 1), (TilePixels{64, 32}));
  EXPECT_EQ(v3d(4, {16, 16, 16}, 4), (TilePixels{8, 8}));
  EXPECT_EQ(v3d(7, {4}, 1), (TilePixels{64, 64}));
  EXPECT_EQ(v3d(7, {4}, 4), (TilePixels{32, 32}));
  EXPECT_EQ(v3d(7, {16, 16, 16, 16}, 4), (TilePixels{8, 8}));
  EXPECT_EQ(powervr_tile(), (TilePixels{32, 32}));
}

}  // namespace
}  // namespace tessera::hardware::tile_rules_test
