// What bounds a frame, of doublings whose gains are known.
#include "timing/bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>

namespace tessera::timing {
namespace {

using hardware::Stage;

struct Frame {
  std::array<double, kBoundCount> gains{};
  std::vector<BoundGuess> guesses;
  double imbalance = 0;
  mutable std::atomic<int> simulated = 0;

  void add(Bound bound, double gain, double most) {
    gains[index(bound)] = gain;
    guesses.push_back({bound, most});
  }
  BoundGain find() const {
    return find_bound(1000, guesses, imbalance, [&](Bound bound) {
      ++simulated;
      return 1000 - gains[index(bound)];
    });
  }
};

TEST(Bound, IsTheDoublingThatGainsMost) {
  Frame frame;
  frame.add(bound_of(Stage::kShader), 190, 300);
  frame.add(bound_of(Stage::kDram), 250, 260);
  frame.add(Bound::kTileCores, 100, 400);
  EXPECT_EQ(frame.find().bound, bound_of(Stage::kDram));
  EXPECT_EQ(frame.find().cycles, 250);
}

TEST(Bound, IsTheMoreSpecificOfThoseThatGainAlike) {
  Frame frame;
  frame.add(Bound::kTileCores, 400, 500);
  frame.add(bound_of(Stage::kShader), 350, 400);
  EXPECT_EQ(frame.find().bound, bound_of(Stage::kShader));
  // A unit that gains much less than all together does not have the frame to itself.
  Frame shared;
  shared.add(Bound::kTileCores, 400, 500);
  shared.add(bound_of(Stage::kShader), 310, 400);
  EXPECT_EQ(shared.find().bound, Bound::kTileCores);
}

TEST(Bound, SimulatesNothingThatCannotMatter) {
  Frame frame;
  frame.add(bound_of(Stage::kShader), 450, 500);
  frame.add(bound_of(Stage::kTexture), 300, 400);
  for (const Stage stage : {Stage::kFetch, Stage::kBoxes, Stage::kDram}) frame.add(bound_of(stage), 10, 20);
  EXPECT_EQ(frame.find().bound, bound_of(Stage::kShader));
  EXPECT_EQ(frame.simulated, 2);
}

// The twin: a guess below the gain leaves the best doubling out.
TEST(Bound, AGuessThatIsTooLowMissesIt) {
  Frame frame;
  frame.add(bound_of(Stage::kShader), 300, 400);
  frame.add(bound_of(Stage::kTexture), 280, 390);
  frame.add(bound_of(Stage::kDram), 900, 100);
  EXPECT_EQ(frame.find().bound, bound_of(Stage::kShader));
}

TEST(Bound, ImbalanceNeedsNoSimulation) {
  Frame frame;
  frame.imbalance = 700;
  frame.add(bound_of(Stage::kShader), 500, 550);
  EXPECT_EQ(frame.find().bound, Bound::kImbalance);
  EXPECT_EQ(frame.simulated, 0);
}

TEST(Bound, NamesAreApart) {
  std::vector<std::string_view> names;
  for (std::size_t b = 0; b < kBoundCount; ++b) names.push_back(name(static_cast<Bound>(b)));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

}  // namespace
}  // namespace tessera::timing
