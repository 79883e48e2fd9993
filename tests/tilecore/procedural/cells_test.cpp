// Cells of procedures: how many samples they have, which of these a tile evaluates, and that they are entries of its list.
#include "tests/support/procedures.h"
#include "tests/support/tests.h"
#include "tests/tilecore/procedural/cell_lists.h"
#include "tests/tilecore/support.h"
#include "tilecore/procedural/cell_steps.h"

namespace tessera::tilecore::cells_test {
namespace {

using shaders::ShapeId;

// ---- Steps ------------------------------------------------------------------------------------------------------

// Written out once more.
bool enough(const CellReach& r, int u, int v, double most, double flat) {
  const double along_x = r.x_u / u + r.x_v / v, along_y = r.y_u / u + r.y_v / v,
               bend = (r.bend_u / u + r.bend_v / v) / std::min(u, v) / 4;
  return along_x <= most * (1 + 1e-12) && along_y <= most * (1 + 1e-12) && bend <= flat * (1 + 1e-12);
}

// Fault of the steps that were chosen for a reach: nothing, or the rule that they break.
std::optional<std::string> fault(const CellReach& r, double most, double flat, const CellSteps& steps) {
  if (!enough(r, steps.u, steps.v, most, flat)) return "CEL1: a footprint is too large";
  for (int u = 1; u <= CellSteps::kMax; ++u)
    for (int v = 1; v <= CellSteps::kMax && u * v < static_cast<int>(steps.count()); ++v)
      if (enough(r, u, v, most * (1 - 1e-9), flat * (1 - 1e-9))) return "CEL2: fewer samples are enough";
  return std::nullopt;
}

CellReach random_reach(Random& random) {
  const auto length = [&] {
    return random.integer(0, 4) == 0 ? 0.0 : std::pow(10.0, static_cast<double>(random.uniform(-3, 1)));
  };
  return {length(), length(), length(), length(), length(), length()};
}

TEST(CellSteps, AreTheFewestWhoseFootprintsAreSmallAndFlatEnough) {  // CEL1, CEL2
  Random random(1);
  int by_size = 0, by_bend = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const CellReach reach = random_reach(random);
    const double most = static_cast<double>(random.uniform(0.2f, 3)),
                 flat = static_cast<double>(random.uniform(0.01f, 1));
    bool clamped = false;
    const CellSteps steps = CellSteps::for_reach(reach, most, flat, clamped);
    if (clamped) continue;
    const std::optional<std::string> wrong = fault(reach, most, flat, steps);
    ASSERT_FALSE(wrong) << *wrong << ", trial " << trial;
    const bool size_alone = steps == CellSteps::for_reach(reach, most, 1e9, clamped);
    (size_alone ? by_size : by_bend) += 1;
  }
  EXPECT_GT(by_size, 300);
  EXPECT_GT(by_bend, 300);
}

TEST(CellSteps, OneMoreOrOneFewerIsNoticed) {  // the twin of the law above
  Random random(2);
  int larger = 0, smaller = 0, trials = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const CellReach reach = random_reach(random);
    bool clamped = false;
    const CellSteps steps = CellSteps::for_reach(reach, 0.5, 0.1, clamped);
    if (clamped || steps.u < 2 || steps.u == CellSteps::kMax) continue;
    ++trials;
    larger += fault(reach, 0.5, 0.1, {static_cast<std::uint16_t>(steps.u + 1), steps.v}) ? 1 : 0;
    smaller += fault(reach, 0.5, 0.1, {static_cast<std::uint16_t>(steps.u - 1), steps.v}) ? 1 : 0;
  }
  EXPECT_GT(trials, 50);
  EXPECT_EQ(larger, trials);
  EXPECT_EQ(smaller, trials);
}

TEST(CellSteps, AreFewWhereTheReachHasNoBound) {
  bool clamped = false;
  EXPECT_EQ(CellSteps::for_reach({std::numeric_limits<double>::infinity(), 0, 0, 1, 0, 0}, 1, 1, clamped),
            (CellSteps{CellSteps::kUnknown, CellSteps::kUnknown}));
  EXPECT_TRUE(clamped);
  clamped = false;
  EXPECT_EQ(CellSteps::for_reach({1e9, 0, 0, 0.3, 0, 0}, 1, 1, clamped), (CellSteps{CellSteps::kMax, 1}));
  EXPECT_TRUE(clamped);
}

// ---- Steps that a tile leaves out -----------------------------------------------------------------------------------

// Two procedures before a camera.
TestFrame two_procedures(Random& random, bool general) {
  TestFrame scene;
  scene::Camera camera;
  camera.near = 0.2f;
  if (random.integer(0, 5) == 0) camera.type = scene::Camera::Type::kOrthographic, camera.x_mag = camera.y_mag = 2;
  if (general && random.coin()) camera.lens = {0.05f, 3.0f};
  test::add_camera(*scene.capture, DVec3(0, 0, 4), camera);
  scene::Material material;
  material.double_sided = random.coin();
  const int number = test::add_material(*scene.capture, material);
  for (int k = 0; k < 2; ++k) {
    const auto id = static_cast<ShapeId>(random.integer(0, test::kShapeCount - 1));
    const int node =
        test::add_procedure(*scene.capture, id, test::random_shape(random, id), DVec3(random.in_box(1)), number);
    if (general && random.coin()) test::add_motion(*scene.capture, node, DVec3(random.in_box(2)));
  }
  scene.pose(96, 64);
  return scene;
}

struct Drawn {
  std::vector<std::uint32_t> patch;
  std::vector<float> z;
  SamplingCounters counters;
};
// Tile by tile; `all_steps`: as if nothing were known of where steps are seen.
Drawn draw_tiles(const scene::FrameGeometry& frame, const ParameterMaps& maps, const binner::Settings& settings) {
  const binner::TileGrid grid(96, 64, 16, 16);
  const CellLists lists(frame, maps, grid, settings);
  const SamplePattern pattern({4, 1, 0});
  SamplingController controller;
  Drawn out;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    TileSamples samples;
    samples.fill(pattern, grid.pixels(tile), static_cast<float>(frame.projection.lens_scale),
                 frame.projection.lens_scale != 0);
    TileState state;
    state.start(samples.count, 16, samples.spp);
    draw_cells(controller, {frame, maps, samples, state}, lists.of_tile(tile));
    out.patch.insert(out.patch.end(), state.patch.begin(), state.patch.end());
    out.z.insert(out.z.end(), state.z.begin(), state.z.end());
  }
  out.counters = controller.take_counters();
  return out;
}

TEST(Cells, EvaluateFewStepsOutsideATileAndLeaveOutNoneThatReachesIt) {  // SC4
  Random random(3);
  SamplingCounters some, all;
  for (int n = 0; n < 40; ++n) {
    const TestFrame scene = two_procedures(random, false);
    ProcedureSettings settings;
    settings.cell_pixels = 12;
    const ParameterMaps maps(*scene.frame, {0, 0, 96, 64}, settings, 2, 64);
    ParameterMaps blind = maps;
    blind.forget_images();
    const Drawn a = draw_tiles(*scene.frame, maps, {}), b = draw_tiles(*scene.frame, blind, {});
    ASSERT_EQ(a.patch, b.patch) << "scene " << n;
    ASSERT_EQ(a.z, b.z) << "scene " << n;
    ASSERT_EQ(a.counters.writes, b.counters.writes);
    tessera::merge(some, a.counters), tessera::merge(all, b.counters);
  }
  EXPECT_EQ(all.samples - some.samples, (all.samples_outside_tile - some.samples_outside_tile) +
                                            (all.samples_backfacing - some.samples_backfacing) +
                                            (all.samples_behind - some.samples_behind) +
                                            (all.samples_not_finite - some.samples_not_finite));
  EXPECT_LT(some.samples_outside_tile * 5, all.samples_outside_tile * 4);
}

// Lists of exact coverage and with times are shorter, and nothing is lost by that.
TEST(Cells, TimesAndExactCoverageSpareTestsAndChangeNothing) {  // SC1, PM1
  Random random(4);
  std::uint64_t tests = 0, more_tests = 0, entries = 0, more_entries = 0;
  for (int n = 0; n < 40; ++n) {
    const TestFrame scene = two_procedures(random, true);
    const scene::FrameGeometry& frame = *scene.frame;
    const ParameterMaps maps(frame, {0, 0, 96, 64}, {}, 2, 64);
    binner::Settings plain;
    plain.coverage = binner::CoverageMethod::kRectangle;
    plain.time_intervals = false;
    const Drawn a = draw_tiles(frame, maps, {}), b = draw_tiles(frame, maps, plain);
    ASSERT_EQ(a.patch, b.patch) << "scene " << n;
    ASSERT_EQ(a.z, b.z) << "scene " << n;
    const binner::TileGrid grid(96, 64, 16, 16);
    tests += a.counters.footprint_tests, more_tests += b.counters.footprint_tests;
    entries += CellLists(frame, maps, grid).counters().entries;
    more_entries += CellLists(frame, maps, grid, plain).counters().entries;
  }
  EXPECT_LT(tests, more_tests);
  EXPECT_LT(entries, more_entries);
}

TEST(Cells, AreNumberedByTheRangesOfTheirSubPatches) {
  for (const std::uint32_t cell : {0u, 1u, 127u, 128u, 16383u, 16384u, 2097152u, 4194303u})
    EXPECT_EQ(ParameterMaps::cell_of(ParameterMaps::range_of(cell)), cell);
}

}  // namespace
}  // namespace tessera::tilecore::cells_test
