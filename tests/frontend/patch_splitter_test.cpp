#include "base/error.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::patch_splitter_test {
namespace {

FrontEndSpec settings() { return gpu::GpuConfiguration{}.front_end_spec(); }

struct Split {
  std::vector<BoundedSubPatch> pieces;
  FrontendCounters counters;
};
Split split_all(const Scene& scene, const FrontEndSpec& s) {
  Split out;
  PatchSplitter splitter(*scene.frame, *scene.pyramids, s);
  for (std::uint32_t p = 0; p < scene.assembly.patch_count(); ++p) splitter.split(p, out.pieces, out.counters);
  return out;
}

std::uint64_t cells_of(const std::vector<BoundedSubPatch>& pieces) {
  std::uint64_t cells = 0;
  for (const BoundedSubPatch& p : pieces)
    cells += static_cast<std::uint64_t>((p.range.i1 - p.range.i0) * (p.range.j1 - p.range.j0));
  return cells;
}

class EveryCriterion : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryCriterion, PartsTheCellsThatItDoesNotCull) {
  Random random(5);
  for (int trial = 0; trial < 30; ++trial) {
    const Scene scene(trial % 2 == 0 ? Hard::kRandom : Hard::kCrossing, random);
    FrontEndSpec s = settings();
    s.split_criterion = static_cast<SplitCriterion>(GetParam());
    s.max_cells = random.integer(4, 64);
    s.split_pixels = static_cast<double>(random.uniform(4, 80));
    s.split_depth = random.integer(0, 8);
    s.split_budget = random.integer(1, 40);
    const Split split = split_all(scene, s);
    std::set<std::tuple<std::uint32_t, int, int>> seen;
    std::map<std::uint32_t, std::size_t> count;
    for (const BoundedSubPatch& p : split.pieces) {
      EXPECT_LE(p.range.i1 - p.range.i0, s.max_cells);
      EXPECT_LE(p.range.j1 - p.range.j0, s.max_cells);
      ++count[p.base_patch];
      for (int j = p.range.j0; j < p.range.j1; ++j)
        for (int i = p.range.i0; i < p.range.i1; ++i)
          EXPECT_TRUE(seen.emplace(p.base_patch, i, j).second) << "a cell is in two sub-patches";
    }
    const FrontendCounters& c = split.counters;
    EXPECT_EQ(seen.size() + c.cells_culled_frustum + c.cells_culled_backface, c.cells);
    EXPECT_EQ(c.sub_patches, split.pieces.size());
    EXPECT_EQ(c.bounds_computed, c.base_patches + 2 * c.splits);
    EXPECT_EQ(c.bounds_computed, c.splits + c.sub_patches + c.culled_frustum + c.culled_backface);
  }
}

std::string criterion_name(const testing::TestParamInfo<std::size_t>& instance) {
  return std::string(kEnumWords<SplitCriterion>[instance.param]);
}
INSTANTIATE_TEST_SUITE_P(Criterion, EveryCriterion, testing::Range(std::size_t{0}, kEnumWords<SplitCriterion>.size()),
                         criterion_name);

TEST(PatchSplitter, TheBudgetLimitsTheCriterionsPieces) {
  Random random(8);
  const Scene scene(Hard::kNoMotion, random);
  FrontEndSpec s = settings();
  s.max_cells = 64;
  s.split_pixels = 1;
  s.split_depth = 12;
  for (const int budget : {1, 2, 7, 32}) {
    s.split_budget = budget;
    std::map<std::uint32_t, int> count;
    for (const BoundedSubPatch& p : split_all(scene, s).pieces) ++count[p.base_patch];
    for (const auto& [patch, pieces] : count) EXPECT_LE(pieces, budget);
  }
}

TEST(PatchSplitter, DepthZeroCutsOnlyPatchesThatATileCoreCannotTake) {
  Random random(8);
  const Scene scene(Hard::kNoMotion, random);
  FrontEndSpec s = settings();
  s.split_depth = 0;
  s.max_cells = 64;
  EXPECT_EQ(split_all(scene, s).counters.splits, 0u);
}

TEST(PatchSplitter, SplitsTheWidestFirst) {
  Random random(12);
  const Scene scene(Hard::kNoMotion, random);
  FrontEndSpec s = settings();
  s.max_cells = 64;
  s.split_pixels = 1;
  s.split_depth = 12;
  s.backface_culling = false;
  s.split_budget = 24;
  const Split few = split_all(scene, s);
  // No piece that could have been split is wider than the widest that was made by the last split allowed.
  double widest = 0, mean = 0;
  for (const BoundedSubPatch& p : few.pieces) {
    const double extent =
        std::max(static_cast<double>(p.bounds.x1 - p.bounds.x0), static_cast<double>(p.bounds.y1 - p.bounds.y0));
    widest = std::max(widest, extent);
    mean += extent / static_cast<double>(few.pieces.size());
  }
  EXPECT_LT(widest, 3.5 * mean);
}

TEST(PatchSplitter, AFinerLimitOnScreenNeverGivesWiderPieces) {
  Random random(13);
  const Scene scene(Hard::kNoMotion, random);
  FrontEndSpec s = settings();
  s.split_budget = 4096;
  s.split_depth = 12;
  std::size_t last = 0;
  for (const double pixels : {400.0, 100.0, 40.0, 15.0}) {
    s.split_pixels = pixels;
    const Split split = split_all(scene, s);
    EXPECT_GE(split.pieces.size(), last);
    last = split.pieces.size();
    EXPECT_EQ(cells_of(split.pieces) + split.counters.cells_culled_frustum + split.counters.cells_culled_backface,
              split.counters.cells);
  }
}

TEST(PatchSplitter, TheFrustumCriterionCullsMoreCellsOfPatchesThatStraddleTheView) {
  Random random(3);
  std::uint64_t whole = 0, split = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Scene scene(Hard::kRandom, random);
    scene.frame->request.width = 150;  // the view ends inside the patches
    FrontEndSpec s = settings();
    s.split_pixels = 1;
    s.max_cells = 64;
    s.split_depth = 0;
    whole += split_all(scene, s).counters.cells_culled_frustum;
    s.split_depth = 8;
    s.split_criterion = SplitCriterion::kFrustum;
    split += split_all(scene, s).counters.cells_culled_frustum;
  }
  EXPECT_GT(split, whole + whole / 4);
}

TEST(FrontEnd, IsTheSameForAnyNumberOfThreadsAndRefusesUnknownNames) {
  EXPECT_FALSE(from_word<BoundMethod>("sphere"));
  EXPECT_FALSE(from_word<SplitCriterion>("alphabetical"));
  Random random(5);
  const Scene scene(Hard::kRandom, random);
  const gpu::GpuConfiguration gpu;
  const FrontEndResult a = run_front_end(*scene.frame, *scene.pyramids, gpu.front_end_spec()),
                       b = run_front_end(*scene.frame, *scene.pyramids, gpu.front_end_spec());
  ASSERT_EQ(a.sub_patches.size(), b.sub_patches.size());
  for (std::size_t k = 0; k < a.sub_patches.size(); ++k) EXPECT_EQ(a.sub_patches[k].range, b.sub_patches[k].range);
}

// ---- Reads of bounding -------------------------------------------------------------------------------------------

// Displaced patches in rows, apart from each other but for the last, which may touch the first: more than
// kCachedRecords lie between.
memory::Ledger bounding_traffic(bool displaced, bool touches, const FrontEndSpec& spec = {}, int rows = 1) {
  constexpr int kInARow = 2 + 2 * static_cast<int>(kCachedRecords);
  const int patches = rows * kInARow;
  scene::Capture capture;
  scene::Material material;
  if (displaced) material.displacement = test::displacement(8, 8, std::vector<float>(64, 0.5f), 0.01f, 0.0f);
  std::vector<Vec3> points;
  for (int k = 0; k < patches; ++k) {
    const bool last = k == patches - 1;
    const std::vector<Vec3> patch = test::flat_patch(
        {last && touches ? -0.1f : 0.15f * static_cast<float>(k % kInARow), 0.15f * static_cast<float>(k / kInARow), 0},
        {0.1f, 0, 0}, {0, 0.1f, 0});
    points.insert(points.end(), patch.begin(), patch.end());
  }
  test::add_node(capture, test::patches(points, test::add_material(capture, material)));
  test::add_camera(capture, DVec3(2.5, 0, 8), scene::Camera{});
  const scene::Assembly assembly = assemble(capture);
  const PyramidLibrary pyramids(assembly);
  scene::FrameRequest request;
  request.width = 320;
  request.height = 240;
  const auto frame = pose_frame(assembly, choose_camera(capture, 320, 240), request);
  const FrontEndResult result = run_front_end(*frame, pyramids, spec);
  EXPECT_EQ(result.counters.base_patches, static_cast<std::uint64_t>(patches));
  return result.ledger;
}
std::uint64_t front_end_reads(const memory::Ledger& ledger, memory::Purpose purpose) {
  return ledger.traffic(memory::Unit::kFrontend, purpose).read_bytes;
}

TEST(FrontEndTraffic, ANeighbourMoreIsARecordMore) {
  using memory::Purpose;
  FrontEndSpec none;
  none.l2_bytes = 0;
  const memory::Ledger apart = bounding_traffic(true, false, none), touching = bounding_traffic(true, true, none);
  const std::uint64_t record = 256;  // 32 of header, 16 points of 12 bytes, in bursts of 64
  EXPECT_EQ(front_end_reads(touching, Purpose::kPatchData), front_end_reads(apart, Purpose::kPatchData) + record);
  // An L2 has it, as its own patch was read.
  EXPECT_EQ(front_end_reads(bounding_traffic(true, true), Purpose::kPatchData),
            front_end_reads(bounding_traffic(true, false), Purpose::kPatchData));
  // Without displacement the vertices of other patches do not matter.
  EXPECT_EQ(front_end_reads(bounding_traffic(false, true), Purpose::kPatchData),
            front_end_reads(bounding_traffic(false, false), Purpose::kPatchData));
}

TEST(FrontEndTraffic, TheL2KeepsHeightsFromOneBlockOfPatchesToTheNext) {
  using memory::Purpose;
  FrontEndSpec with, without;
  without.l2_bytes = 0;
  // The patches share a map of 64 heights: nothing leaves an L2 that holds its tables, and blocks begin with empty
  // caches of their own.
  const std::uint64_t once = front_end_reads(bounding_traffic(true, false, with, 6), Purpose::kTexture),
                      again = front_end_reads(bounding_traffic(true, false, without, 6), Purpose::kTexture);
  EXPECT_LE(once, 64u * 3 * WindowTable::kEntryBytes * 4) << "three entries to a height, a pyramid of them";
  EXPECT_GT(again, 2 * once) << "204 patches are four blocks";
  FrontEndSpec wide = with;
  wide.l2_bytes = 16 << 20;
  EXPECT_EQ(front_end_reads(bounding_traffic(true, false, wide, 6), Purpose::kTexture), once);
}

TEST(FrontEndTraffic, HeightsThatBoundDisplacementAreFetched) {
  using memory::Purpose;
  EXPECT_EQ(front_end_reads(bounding_traffic(false, false), Purpose::kTexture), 0u);
  const std::uint64_t bytes = front_end_reads(bounding_traffic(true, false), Purpose::kTexture);
  EXPECT_GT(bytes, 0u);
  EXPECT_EQ(bytes % 64, 0u);
}

TEST(FrontEndTraffic, RecordsAmongTheLastUsedCostNothing) {  // BFT1
  HeightTableCache fetches({1024, 4, 64, 2});
  fetches.pass_record(1);
  fetches.fetch_record(1, 224, 16);
  EXPECT_EQ(fetches.take_record_bytes(), 0u);
  EXPECT_EQ(fetches.take_elements(), 0u);
  fetches.fetch_record(2, 224, 16);
  fetches.fetch_record(3, 224, 16);
  fetches.fetch_record(2, 224, 16);
  EXPECT_EQ(fetches.take_record_bytes(), 2 * 256u);
  EXPECT_EQ(fetches.take_elements(), 32u);
  fetches.fetch_record(1, 224, 16);
  EXPECT_EQ(fetches.take_record_bytes(), 256u);
}

// ---- Area of a box ----------------------------------------------------------------------------------------------

TEST(BoxArea, IsTheAreaOfItsFacesInTheWorld) {
  MovingBox box = empty_box({DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)});
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      box.low[key][axis] = 0, box.high[key][axis] = static_cast<double>(axis + 1);
  const auto scaled = [](float s) { return Mat4(glm::mat3(s)); };
  EXPECT_NEAR(box_area(box, {scaled(1), scaled(1)}), 2 * (2 + 6 + 3), 1e-9);
  EXPECT_NEAR(box_area(box, {scaled(1), scaled(3)}), 9 * 22, 1e-6) << "the larger of both keys";
}

}  // namespace
}  // namespace tessera::frontend::patch_splitter_test
