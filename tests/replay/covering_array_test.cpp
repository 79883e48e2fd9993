#include "tests/support/covering_array.h"
#include "tests/support/tests.h"

namespace tessera::test::covering_array_test {
namespace {

const std::vector<Choices> kProducts = {{9, 3, 2, 3}, {2, 2}, {5}, {1, 4, 1}, {3, 3, 3, 3}, {2, 2, 2, 2, 2, 2, 2}};

TEST(CoveringArray, CA1EveryPairOfLevelsIsInSomeRow) {
  for (const Choices& levels : kProducts) EXPECT_TRUE(missing_pairs(levels, covering_array(levels)).empty());
}

TEST(CoveringArray, HasAtLeastTheTwoLargestFactorsAndFarLessThanTheProduct) {
  EXPECT_GE(covering_array(kProducts[0]).size(), 27u);
  EXPECT_LE(covering_array(kProducts[0]).size(), 30u);
  EXPECT_LE(covering_array(kProducts[4]).size(), 15u);  // of 81; 9 is the least there is
  for (const Choices& levels : kProducts)
    EXPECT_EQ(whole_product(levels).size(),
              std::accumulate(levels.begin(), levels.end(), std::size_t{1}, std::multiplies<>()));
}

TEST(CoveringArray, RowsChooseLevelsThatExist) {
  for (const Choices& levels : kProducts)
    for (const Choices& row : covering_array(levels)) {
      ASSERT_EQ(row.size(), levels.size());
      for (std::size_t f = 0; f < row.size(); ++f) EXPECT_LT(row[f], levels[f]);
    }
}

// Each row of a small one is needed; without it, or with one choice changed everywhere, pairs are missing.
TEST(CoveringArrayTwin, ARowTooFewOrALevelNeverChosenIsCaught) {
  const Choices levels = {9, 3, 2, 3};
  const std::vector<Choices> sound = covering_array(levels);
  std::vector<Choices> fewer(sound.begin() + 1, sound.end()), never = sound;
  EXPECT_FALSE(missing_pairs(levels, fewer).empty());
  for (Choices& row : never) row[2] = 0;
  EXPECT_EQ(missing_pairs(levels, never).size(), 9u + 3u + 3u);
}

}  // namespace
}  // namespace tessera::test::covering_array_test
