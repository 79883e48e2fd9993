// The bound of a frame, found from doublings whose gains are known.
#include <rapidcheck/gtest.h>
#include <atomic>

#include "tests/support/tests.h"
#include "timing/bound.h"

namespace tessera::timing::bound_test {
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
    return find_bound(1000, guesses, imbalance, [&](Bound bound, double limit) {
      ++simulated;
      const double cycles = 1000 - gains[index(bound)];
      return cycles <= limit ? cycles : limit + 1e-9;
    });
  }
  // The judge: all doublings are simulated to their ends.
  BoundGain find_among_all() const {
    std::array<double, kBoundCount> all{};
    for (const BoundGuess& guess : guesses) all[index(guess.bound)] = gains[index(guess.bound)];
    all[index(Bound::kImbalance)] = imbalance;
    const double best = *std::max_element(all.begin(), all.end());
    for (std::size_t b = 0; b < kBoundCount; ++b)
      if (all[b] >= kNearlyBest * best && (all[b] > 0 || b == index(Bound::kImbalance)))
        return {static_cast<Bound>(b), all[b]};
    return {};
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

TEST(Bound, IsTheMostSpecificAmongEqualGains) {
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
  EXPECT_EQ(frame.simulated, 1) << "the first gains more than four fifths of any other's possible gain";
  // One that may gain enough more, or is more specific and may gain nearly as much, is simulated, and no third.
  Frame other;
  other.add(bound_of(Stage::kShader), 300, 500);
  other.add(Bound::kTileCores, 320, 400);
  other.add(Bound::kCaches, 100, 200);
  EXPECT_EQ(other.find().bound, bound_of(Stage::kShader));
  EXPECT_EQ(other.simulated, 2);
}

RC_GTEST_PROP(Bound, EqualsTheBoundOfSimulatingAll, ()) {
  Frame frame;
  const int scale = *rc::gen::element(10, 100, 1000);
  const auto up_to = [&](int most) { return *rc::gen::inRange(0, most * scale / 1000 + 1) * (1000.0 / scale); };
  for (std::size_t b = 0; b + 1 < kBoundCount; ++b) {
    if (*rc::gen::inRange(0, 3) == 0) continue;
    const double gain = up_to(500);
    frame.add(static_cast<Bound>(b), gain, gain + up_to(*rc::gen::element(10, 100, 500)));
  }
  frame.imbalance = up_to(500);
  const BoundGain found = frame.find(), all = frame.find_among_all();
  RC_ASSERT(found.bound == all.bound);
  RC_ASSERT(found.cycles == all.cycles);
}

TEST(Bound, AStageWithoutGainIsNoBound) {
  Frame frame;
  frame.add(bound_of(Stage::kBoxes), 0, 100);
  EXPECT_EQ(frame.find().bound, Bound::kImbalance);
  EXPECT_EQ(frame.find().cycles, 0);
}

TEST(Bound, AStageThatMayGainExactlyEnoughIsSimulated) {
  Frame frame;
  frame.imbalance = 500;
  frame.add(bound_of(Stage::kBoxes), 400, 400);
  EXPECT_EQ(frame.find().bound, bound_of(Stage::kBoxes));
  EXPECT_EQ(frame.find_among_all().bound, bound_of(Stage::kBoxes));
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
}  // namespace tessera::timing::bound_test
