#include "frontend/split_cost.h"
#include "frontend/patch_splitter.h"
#include "gpu/configuration.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::split_cost_test {
namespace {

SplitPrices middle() { return gpu::GpuConfiguration{}.split_prices(); }

DVec2 random_side(Random& random, float most) {
  const Vec3 v = random.in_box(most);
  return {static_cast<double>(v.x), static_cast<double>(v.y)};
}

ScreenShape random_shape(Random& random, float most) {
  ScreenShape shape;
  for (std::size_t k = 0; k < 4; ++k) shape.sides[k] = random_side(random, most);
  shape.sides[4] = {static_cast<double>(random.uniform(0, 8)), 0};
  shape.sides[5] = {0, static_cast<double>(random.uniform(0, 8))};
  return shape;
}

// Bins that the zonotope around `centre` touches, by separating axes: those of the bins and the normals of its sides.
int bins_touched(const ScreenShape& shape, DVec2 centre, double bin_width, double bin_height) {
  const auto reach = [&](DVec2 axis) {
    double sum = 0;
    for (const DVec2& side : shape.sides) sum += std::abs(glm::dot(side, axis)) / 2;
    return sum;
  };
  const double rx = shape.width() / 2, ry = shape.height() / 2;
  const auto bin = [](double at, double size) { return static_cast<int>(std::floor(at / size)); };
  int touched = 0;
  for (int row = bin(centre.y - ry, bin_height); row <= bin(centre.y + ry, bin_height); ++row)
    for (int column = bin(centre.x - rx, bin_width); column <= bin(centre.x + rx, bin_width); ++column) {
      const DVec2 apart = DVec2((column + 0.5) * bin_width, (row + 0.5) * bin_height) - centre;
      touched += std::none_of(shape.sides.begin(), shape.sides.end(), [&](const DVec2& side) {
        const DVec2 normal(-side.y, side.x);
        return std::abs(glm::dot(apart, normal)) >
               reach(normal) + (std::abs(normal.x) * bin_width + std::abs(normal.y) * bin_height) / 2;
      });
    }
  return touched;
}

// The mean over a lattice of places within a bin.
double mean_bins(const ScreenShape& shape, const SplitPrices& prices) {
  constexpr int kPlaces = 48;
  int touched = 0;
  for (int y = 0; y < kPlaces; ++y)
    for (int x = 0; x < kPlaces; ++x)
      touched +=
          bins_touched(shape, DVec2((x + 0.5) / kPlaces * prices.bin_width, (y + 0.5) / kPlaces * prices.bin_height),
                       prices.bin_width, prices.bin_height);
  return static_cast<double>(touched) / (kPlaces * kPlaces);
}

TEST(SplitCost, ExpectedBinsAreTheMeanOverAllPlaces) {  // SPC1
  Random random(1);
  SplitPrices prices = middle();
  for (int trial = 0; trial < 40; ++trial) {
    prices.bin_width = 8.0 * random.integer(1, 8);
    prices.bin_height = 8.0 * random.integer(1, 8);
    const ScreenShape shape = random_shape(random, trial < 20 ? 12.0f : 60.0f);
    const double expected = SplitCost(prices).expected_bins(shape), mean = mean_bins(shape, prices);
    EXPECT_NEAR(expected, mean, 0.02 * mean) << trial;
  }
}

TEST(SplitCost, ARectangleTouchesTheProductOfColumnsAndRows) {  // SPC1
  const SplitPrices prices = middle();
  ScreenShape shape;
  shape.sides[0] = {40, 0};
  shape.sides[1] = {0, 100};
  const double product = (40 / prices.bin_width + 1) * (100 / prices.bin_height + 1);
  EXPECT_DOUBLE_EQ(SplitCost(prices).expected_bins(shape), product);
  EXPECT_NEAR(mean_bins(shape, prices), product, 0.01 * product);
}

// What SPC1 catches: the rectangle around a slanting shape, and a bin forgotten.
TEST(SplitCost, TheBoundingRectangleOfASlantingShapeIsCaught) {
  SplitPrices prices = middle();
  ScreenShape shape;
  shape.sides[0] = {150, 150};
  shape.sides[1] = {4, -4};
  const double mean = mean_bins(shape, prices), expected = SplitCost(prices).expected_bins(shape);
  prices.rectangles = true;
  const double rectangle = SplitCost(prices).expected_bins(shape);
  EXPECT_NEAR(expected, mean, 0.02 * mean);
  EXPECT_GT(rectangle, 1.5 * mean);
  EXPECT_LT(expected - 1, 0.98 * mean);
  EXPECT_DOUBLE_EQ(rectangle, (154 / prices.bin_width + 1) * (154 / prices.bin_height + 1))
      << "lists that take the whole rectangle";
}

TEST(SplitCost, AGainIsTheDifferenceOfBothWays) {  // SPC2
  Random random(2);
  const SplitPrices prices = middle();
  const SplitCost cost(prices);
  for (int trial = 0; trial < 200; ++trial) {
    const ScreenShape shape = random_shape(random, 80);
    const auto side = static_cast<std::size_t>(random.integer(0, 1));
    const bool moving = trial % 2 == 0;
    const double n = random.integer(8, 256), fetched = 64.0 * random.integer(0, 8);
    // The closed form of the header: b is what the side's length has a part in.
    ScreenShape without = shape;
    without.sides[side] = {};
    const double bins = cost.expected_bins(shape), b = bins - cost.expected_bins(without);
    const double entry = prices.entry + 2 * prices.byte * (prices.entry_bytes + (moving ? prices.entry_time_bytes : 0)),
                 cell = prices.box * prices.boxes_per_cell, record = 2 * prices.byte * prices.record_bytes,
                 bound = prices.bound + prices.byte * fetched;
    const double expected = n * cell * b / 2 - entry * (bins - b) - record - 2 * bound;
    EXPECT_NEAR(cost.gain(shape, n, moving, side, fetched), expected, 1e-9 * (n * cell * bins + bound)) << trial;
  }
}

TEST(SplitCost, NothingToBuildIsNothingToSplitFor) {  // SPC3
  Random random(3);
  SplitPrices prices = middle();
  prices.box = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const ScreenShape shape = random_shape(random, 200);
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
      EXPECT_LT(SplitCost(prices).gain(shape, 256, false, side, 0), 0);
      EXPECT_EQ(SplitCost(SplitPrices{}).gain(shape, 256, false, side, 256), 0) << "all free";
    }
  }
}

TEST(SplitCost, BothHalvesPayForTheWayThatTheySweep) {
  const SplitPrices prices = middle();
  const SplitCost cost(prices);
  ScreenShape still;
  still.sides[0] = {64, 0};
  still.sides[1] = {0, 16};
  ScreenShape moving = still;
  moving.sides[3] = {128, 0};  // along the side that is cut
  const double bins = 128 / prices.bin_width * (16 / prices.bin_height + 1);
  EXPECT_NEAR(cost.expected_bins(moving) - cost.expected_bins(still), bins, 1e-12);
  const double entry = prices.entry + 2 * prices.byte * prices.entry_bytes;
  EXPECT_NEAR(cost.gain(still, 64, false, 0, 0) - cost.gain(moving, 64, false, 0, 0), entry * bins, 1e-9);
}

TEST(ScreenShape, HasTheSizeOfThePartOfTheBoundsInTheFrame) {
  Random random(4);
  for (int kind = 0; kind < static_cast<int>(Hard::kCount); ++kind)
    for (int trial = 0; trial < 5; ++trial) {
      const Scene scene(static_cast<Hard>(kind), random);
      SubPatchBounder bounder(*scene.frame, *scene.pyramids, BoundMethod::kNpatch);
      for (std::uint32_t patch = 0; patch < scene.assembly.patch_count(); ++patch) {
        bounder.begin(patch);
        const SubPatchBody body = bounder.body(patch_cells(*scene.frame, patch));
        const auto bounds = screen_bounds(body.corners, scene.frame->projection, body.margin);
        if (!bounds || outside_frame(*bounds, 320, 240)) continue;
        const ScreenShape shape = screen_shape(body.corners, *bounds, 320, 240);
        const auto part = [](float low, float high, float size) {
          return static_cast<double>(std::min(high, size) - std::max(low, 0.0f));
        };
        const double width = part(bounds->x0, bounds->x1, 320), height = part(bounds->y0, bounds->y1, 240);
        EXPECT_NEAR(shape.width(), width, 1e-6 * width + 1e-9) << kind;
        EXPECT_NEAR(shape.height(), height, 1e-6 * height + 1e-9) << kind;
        EXPECT_LE(shape.area(), width * height * (1 + 1e-9)) << kind;
      }
    }
}

TEST(ScreenShape, OfCornersThatAreNoNumbersIsARectangleThatNoSplitLessens) {
  MovingCorners corners{};
  corners[3].x = std::numeric_limits<double>::quiet_NaN();
  const float all = std::numeric_limits<float>::infinity();
  const ScreenShape shape = screen_shape(corners, {-all, -all, all, all, 0, 0, 1, true}, 320, 240);
  EXPECT_EQ(shape.width(), 320);
  EXPECT_EQ(shape.height(), 240);
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}})
    EXPECT_LT(SplitCost(middle()).gain(shape, 256, false, side, 0), 0);
}

// ---- The splitter by cost ---------------------------------------------------------------------------------------

std::vector<BoundedSubPatch> split_by(const Scene& scene, const FrontEndSpec& spec, FrontendCounters& counters) {
  std::vector<BoundedSubPatch> pieces;
  PatchSplitter splitter(*scene.frame, *scene.pyramids, spec);
  for (std::uint32_t p = 0; p < scene.assembly.patch_count(); ++p) splitter.split(p, pieces, counters);
  return pieces;
}

FrontEndSpec by_cost(double box) {
  FrontEndSpec spec = gpu::GpuConfiguration{}.front_end_spec();
  spec.split_criterion = SplitCriterion::kCost;
  spec.backface_culling = false;
  spec.max_cells = 64;
  spec.prices.box *= box;
  return spec;
}

TEST(SplitByCost, LeavesNothingThatIsWorthASplit) {
  Random random(6);
  std::size_t pieces = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Scene scene(trial % 2 == 0 ? Hard::kRandom : Hard::kCrossing, random);
    FrontEndSpec spec = by_cost(4);
    spec.split_depth = 12;
    spec.split_budget = 4096;
    FrontendCounters counters;
    for (const BoundedSubPatch& piece : split_by(scene, spec, counters)) {
      const ScreenShape shape = screen_shape(piece.corners(*scene.frame), piece.bounds, 320, 240);
      const int width = piece.range.i1 - piece.range.i0, height = piece.range.j1 - piece.range.j0;
      const bool moving = (piece.effects & kEffectMotion) != 0;
      const std::array<int, 2> sides = {width, height};
      for (std::size_t side = 0; side < 2; ++side) {
        if (sides[side] < 4) continue;
        EXPECT_LE(SplitCost(spec.prices).gain(shape, width * height, moving, side, 0), 1e-9);
      }
      ++pieces;
    }
  }
  EXPECT_GT(pieces, 200u);
}

TEST(SplitByCost, FreeBoxesSplitNothingAndCostlyOnesUpToTheBudget) {
  Random random(7);
  const Scene scene(Hard::kNoMotion, random);
  FrontEndSpec spec = by_cost(0);
  FrontendCounters free, costly;
  split_by(scene, spec, free);
  EXPECT_EQ(free.splits, 0u);
  spec = by_cost(1000);
  spec.split_budget = 7;
  std::map<std::uint32_t, int> count;
  for (const BoundedSubPatch& piece : split_by(scene, spec, costly)) ++count[piece.base_patch];
  EXPECT_EQ(costly.splits, 2 * 6u);
  for (const auto& [patch, pieces] : count) EXPECT_EQ(pieces, 7);
}

}  // namespace
}  // namespace tessera::frontend::split_cost_test
