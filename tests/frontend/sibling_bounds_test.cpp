// Sub-patches that are bounded together have the bodies that they have alone, to the bit.
#include "base/simd_targets.h"
#include "frontend/patch_splitter.h"
#include "gpu/configuration.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::sibling_bounds_test {
namespace {

bool same(const RoundingMargin& a, const RoundingMargin& b) {
  return a.position == b.position && a.w == b.w && a.depth == b.depth && a.pixels == b.pixels;
}
bool same(const ValueRange& a, const ValueRange& b) { return a.low == b.low && a.high == b.high; }
bool same(const scene::ParameterRange& a, const scene::ParameterRange& b) {
  return a.u0 == b.u0 && a.v0 == b.v0 && a.u1 == b.u1 && a.v1 == b.v1;
}
bool same(const SubPatchBody& a, const SubPatchBody& b) {
  return a.corners == b.corners && same(a.margin, b.margin) && same(a.motion_margin, b.motion_margin) &&
         a.box.axes == b.box.axes && a.box.low == b.box.low && a.box.high == b.box.high;
}
bool same_nets(const SubPatchBounder& a, const SubPatchBounder& b) {
  for (std::size_t key = 0; key < a.nets().size(); ++key)
    if (a.nets()[key].c != b.nets()[key].c) return false;
  return a.nets().size() == b.nets().size();
}

// Ranges of a patch's grid, with its boundary and without, down to single cells.
std::vector<scene::CellRange> some_ranges(const scene::TessellationPattern& pattern, Random& random, int count) {
  std::vector<scene::CellRange> ranges;
  for (int k = 0; k < count; ++k) {
    scene::CellRange r;
    r.i0 = static_cast<std::uint8_t>(random.coin() ? 0 : random.integer(0, pattern.nu - 1));
    r.j0 = static_cast<std::uint8_t>(random.coin() ? 0 : random.integer(0, pattern.nv - 1));
    r.i1 = static_cast<std::uint8_t>(std::min<int>(pattern.nu, r.i0 + random.integer(1, 16)));
    r.j1 = static_cast<std::uint8_t>(std::min<int>(pattern.nv, r.j0 + random.integer(1, 16)));
    ranges.push_back(r);
  }
  return ranges;
}

struct SiblingOutcome {
  int bodies = 0, together = 0, different = 0;
};

// Bounds each range alone, and all together, one to four at a time; each bounder fetches through caches of its own.
void compare(const Scene& scene, BoundMethod method, Random& random, SiblingOutcome& out) {
  const HeightTableCache::Caches caches{1024, 4, 64, 2};
  HeightTableCache fetches_alone(caches), fetches_together(caches);
  SubPatchBounder alone(*scene.frame, *scene.pyramids, method, &fetches_alone),
      together(*scene.frame, *scene.pyramids, method, &fetches_together);
  for (std::uint32_t patch = 0; patch < scene.assembly.patch_count(); ++patch) {
    alone.begin(patch);
    together.begin(patch);
    const auto ranges = some_ranges(scene.frame->pattern_of(patch), random, random.integer(1, 4));
    std::array<SiblingBound, kSiblings> siblings;
    together.bound(ranges, siblings);
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      const SubPatchBody one = alone.body(ranges[k]), other = together.use(siblings[k]);
      ++out.bodies;
      out.together += siblings[k].bounded ? 1 : 0;
      const bool state = same(alone.range(), together.range()) && same(alone.inner_range(), together.inner_range()) &&
                         alone.foreign_boundary() == together.foreign_boundary() && same_nets(alone, together) &&
                         alone.offsets_vanish() == together.offsets_vanish() &&
                         (!alone.displaced() || same(alone.offsets(), together.offsets()));
      const bool traffic = fetches_alone.pending_bytes() == fetches_together.pending_bytes() &&
                           fetches_alone.take_missed_lines() == fetches_together.take_missed_lines();
      out.different += same(one, other) && state && traffic ? 0 : 1;
    }
  }
}

class Siblings : public testing::TestWithParam<std::tuple<int, int>> {
  void TearDown() override { force_simd_target(""); }
};

TEST_P(Siblings, AreBoundedAsEachAloneByEveryTarget) {  // SB1, SB2
  const auto kind = static_cast<Hard>(std::get<0>(GetParam()));
  const auto method = static_cast<BoundMethod>(std::get<1>(GetParam()));
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    Random random(40 + static_cast<std::uint32_t>(kind));
    SiblingOutcome out;
    for (int trial = 0; trial < 40; ++trial) compare(Scene(kind, random), method, random, out);
    EXPECT_EQ(out.different, 0) << target << ", of " << out.bodies;
    EXPECT_EQ(out.together, method == BoundMethod::kInterval ? 0 : out.bodies) << target;
    EXPECT_GT(out.bodies, 100);
  }
}

std::string sibling_case(const testing::TestParamInfo<std::tuple<int, int>>& instance) {
  const auto [kind, method] = instance.param;
  return std::string(kHardNames[kind]) + "_" + std::string(kEnumWords<BoundMethod>[static_cast<std::size_t>(method)]);
}
INSTANTIATE_TEST_SUITE_P(HardCase, Siblings,
                         testing::Combine(testing::Range(0, static_cast<int>(Hard::kCount)),
                                          testing::Range(0, static_cast<int>(kEnumWords<BoundMethod>.size()))),
                         sibling_case);

TEST(SiblingsTwin, ABodyOfOtherCellsIsCaught) {
  Random random(3);
  const Scene scene(Hard::kRandom, random);
  SubPatchBounder bounder(*scene.frame, *scene.pyramids, BoundMethod::kTpatch);
  bounder.begin(0);
  const std::array<scene::CellRange, 2> ranges = {scene::CellRange{0, 0, 4, 4}, scene::CellRange{4, 0, 8, 4}};
  std::array<SiblingBound, 2> siblings;
  bounder.bound(ranges, siblings);
  EXPECT_FALSE(same(bounder.use(siblings[0]), bounder.body(ranges[1])));
}

TEST(Siblings, ThatAreNotUsedFetchNothing) {  // SB2
  Random random(4);
  const Scene scene(Hard::kRandom, random);
  HeightTableCache fetches({1024, 4, 64, 2});
  SubPatchBounder bounder(*scene.frame, *scene.pyramids, BoundMethod::kNpatch, &fetches);
  bounder.begin(0);
  (void)fetches.take_missed_lines();
  const std::uint64_t before = fetches.pending_bytes();
  const std::array<scene::CellRange, 2> ranges = {scene::CellRange{1, 1, 4, 4}, scene::CellRange{4, 1, 8, 4}};
  std::array<SiblingBound, 2> siblings;
  bounder.bound(ranges, siblings);
  EXPECT_EQ(fetches.pending_bytes(), before);
  (void)bounder.use(siblings[1]);
  EXPECT_GT(fetches.pending_bytes(), before);
}

// Compares the splitter's sub-patches with a bounder that looks at one range after another.
TEST(Siblings, OfTheSplitterHaveTheBoundsOfTheirCells) {  // SB1
  Random random(12);
  std::size_t pieces = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Scene scene(trial % 2 == 0 ? Hard::kRandom : Hard::kCrossing, random);
    FrontEndSpec s = gpu::GpuConfiguration{}.front_end_spec();
    s.split_criterion = static_cast<SplitCriterion>(trial % 5);
    s.split_pixels = 8;
    s.split_budget = random.integer(1, 40);
    PatchSplitter splitter(*scene.frame, *scene.pyramids, s);
    SubPatchBounder bounder(*scene.frame, *scene.pyramids, s.bound_method);
    for (std::uint32_t patch = 0; patch < scene.assembly.patch_count(); ++patch) {
      std::vector<BoundedSubPatch> out;
      FrontendCounters counters;
      splitter.split(patch, out, counters);
      bounder.begin(patch);
      for (const BoundedSubPatch& piece : out) {
        const SubPatchBody body = bounder.body(piece.range);
        const auto bounds = screen_bounds(body.corners, scene.frame->projection, body.margin);
        ASSERT_TRUE(bounds);
        EXPECT_EQ(piece.box.low, body.box.low);
        EXPECT_EQ(piece.box.high, body.box.high);
        EXPECT_EQ(piece.bounds.x0, bounds->x0);
        EXPECT_EQ(piece.bounds.y1, bounds->y1);
        EXPECT_EQ(piece.bounds.far_z, bounds->far_z);
        ++pieces;
      }
    }
  }
  EXPECT_GT(pieces, 300u);
}

}  // namespace
}  // namespace tessera::frontend::sibling_bounds_test
