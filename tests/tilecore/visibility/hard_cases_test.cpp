// Hard cases of visibility, each by name: hits against double precision (exact_hits.h) or against a count, the same
// by every method.
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/exact_hits.h"

namespace tessera::tilecore::hard_cases_test {
namespace {

constexpr std::pair<bool, bool> kMotionAndLens[] = {{false, false}, {true, false}, {false, true}, {true, true}};

// Everything agrees with the oracle, and the oracle could say nearly always.
void expect_exact(const MethodMesh& m, Comparison& total) {
  const std::set<HitSet::Key> found = hits_by_class(m);
  const Comparison c = compare_with_exact(m, found);
  EXPECT_EQ(c.wrong, 0);
  total.hits += c.hits;
  total.too_close += c.too_close;
  expect_all_methods_find(m, found);
}

TEST(HardCases, HitsEqualDoublePrecisionUnderAllEffects) {
  Random random(1);
  Comparison total;
  for (const bool orthographic : {false, true})
    for (const auto& [motion, lens] : kMotionAndLens)
      for (const bool cluster : {false, true})
        expect_exact(random_mesh(random, {{motion, lens}, orthographic, cluster, 0, 0, 2, {0, 0, 24, 16}, 4, 16}),
                     total);
  EXPECT_GT(total.hits, 5000);
  EXPECT_LT(total.too_close, total.hits / 100);
}

TEST(HardCases, SamplesThatLookASixtyFourthOfTheShutterLateAreCaught) {
  Random random(1);
  int wrong = 0;
  for (int trial = 0; trial < 4; ++trial) {
    MethodMesh m = random_mesh(random, {{true, trial % 2 == 0}});
    const auto found = hits_by_class(m);
    for (auto& time : m.samples.time) time = static_cast<std::uint16_t>(std::min(time + 1024, 0xFFFF));
    wrong += compare_with_exact(m, found).wrong;
  }
  EXPECT_GT(wrong, 100);
}

// ---- Shared edges and vertices ----------------------------------------------------------------------------------

// A sheet of cells of 2x2 pixels, its vertices in the middle of pixels, that moves 512 pixels along x: at t = (n + 1/2)
// / 256 it is 2n + 1 pixels further, exactly. With one sample in the middle of each pixel, every sample is on a vertex, an edge or
// a diagonal at every time. It covers the tile of 16x8 pixels during the whole shutter.
MethodMesh sheet_of_ties(RayEffects effects, bool orthographic, float z0, float z1) {
  MethodMesh m;
  m.effects = effects;
  m.settings.orthographic = orthographic;
  m.settings.inverse_focus = 0.25f;
  m.lens_radius = effects.lens ? 3.0f : 0.0f;
  constexpr int kColumns = 270, kRows = 8;
  m.resize((kColumns + 1) * (kRows + 1));
  for (int j = 0; j <= kRows; ++j)
    for (int i = 0; i <= kColumns; ++i) {
      const auto v = static_cast<std::size_t>(j * (kColumns + 1) + i);
      m.place(v, -517.5f + 2 * static_cast<float>(i), -3.5f + 2 * static_cast<float>(j), z0);
      m.move(v, 512, 0, z1);
    }
  m.add_grid_cells(kColumns, kRows);
  m.finish({0, 0, 16, 8}, 1);
  return m;
}

void expect_each_sample_once(const MethodMesh& m, const std::set<HitSet::Key>& hits) {
  std::map<std::uint32_t, int> count;
  for (const HitSet::Key& hit : hits) ++count[std::get<0>(hit)];
  for (std::uint32_t s = 0; s < m.samples.count; ++s)
    EXPECT_EQ(count[s], 1) << "sample " << s << " at t = " << m.samples.t(s);
}

TEST(HardCases, SamplesOnSharedEdgesAndVerticesAreHitOnceAtEveryTime) {
  for (const bool orthographic : {false, true})
    for (const auto& [motion, lens] : kMotionAndLens)
      for (const float z1 : {2.0f, 3.0f}) {
        const MethodMesh m = sheet_of_ties({motion, lens}, orthographic, 2, z1);
        const auto hits = hits_by_class(m);
        expect_each_sample_once(m, hits);
        // Where nothing rounds, the oracle finds every sample on an edge.
        if (!lens && (orthographic || z1 == 2.0f || !motion)) {
          EXPECT_GE(compare_with_exact(m, hits).too_close, static_cast<int>(m.samples.count));
        }
        expect_all_methods_find(m, hits);
      }
}

TEST(HardCases, SamplesOnSharedEdgesAndVerticesAreHitOnceAtShutterOpenAndAtTheLastTime) {
  for (const bool orthographic : {false, true}) {
    MethodMesh m = sheet_of_ties({true, false}, orthographic, 2, 2);
    for (std::size_t s = 0; s < m.samples.count; ++s) {
      // t = 0, 1/2, and 65535/65536: at that the sheet has moved 512 - 1/128 pixels.
      m.samples.time[s] = s % 3 == 0 ? 0 : s % 3 == 1 ? 0x8000 : 0xFFFF;
      m.samples.x[s] -= s % 3 == 2 ? 1.0f / 128 : 0.0f;
    }
    m.samples.half_quantum = 0;
    const auto hits = all_pairs(m);
    expect_each_sample_once(m, hits);
    EXPECT_GE(compare_with_exact(m, hits).too_close, static_cast<int>(m.samples.count));
    expect_all_methods_find(m, hits, false);
  }
}

TEST(HardCases, ASheetWithoutOneCellIsCaughtByTheCount) {
  MethodMesh m = sheet_of_ties({true, false}, false, 2, 2);
  const auto whole = hits_by_class(m);
  // The cell that some sample hits.
  const std::uint32_t seen = std::get<1>(*whole.begin()) & ~1u;
  for (std::size_t slot = 0; slot < m.mesh.triangle.size(); ++slot)
    if (m.mesh.used[slot] && m.mesh.triangle[slot] == seen)
      m.mesh.leaves[slot / kLeafCells].cells &= ~(1u << slot % kLeafCells);
  EXPECT_LT(all_pairs(m).size(), whole.size());
}

// ---- Triangles that change within the shutter -------------------------------------------------------------------

TEST(HardCases, ATriangleThatIsDegenerateAtOneTimeOnlyHoldsNothingThenAndIsExactBeforeAndAfter) {
  Random random(2);
  Comparison total;
  int samples_then = 0;
  for (int trial = 0; trial < 30; ++trial) {
    MethodMesh m;
    m.effects = {true, false};
    m.settings.orthographic = trial % 2 == 0;
    m.resize(3);
    // The third corner crosses the line through the others at t = 257/512, in either direction: at the time of the
    // stencil value 128.
    const auto even = [&](int low, int high) { return static_cast<float>(2 * random.integer(low, high)); };
    const float ax = even(0, 4), ay = even(0, 3), bx = ax + even(4, 10), by = ay + even(-3, 6),
                along = 0.5f * static_cast<float>(random.integer(0, 3));
    const float px = ax + along * (bx - ax), py = ay + along * (by - ay), qx = even(-4, 4),
                qy = even(1, 6) * (random.coin() ? 1.0f : -1.0f);
    m.place(0, ax, ay, 2);
    m.place(1, bx, by, 2);
    m.place(2, px + qx * (257.0f / 256), py + qy * (257.0f / 256), 2);
    m.move(2, -2 * qx, -2 * qy, 2);
    m.settings.limits.keep_positive = trial % 3 != 1;
    m.settings.limits.keep_negative = trial % 3 != 2;
    m.add_only_cell({0, 1, 2, 2});
    m.finish({0, 0, 24, 16}, 16);
    for (const HitSet::Key& hit : hits_by_class(m)) EXPECT_NE(m.samples.time[std::get<0>(hit)], 0x8000);
    for (std::size_t s = 0; s < m.samples.count; ++s) samples_then += m.samples.time[s] == 0x8000 ? 1 : 0;
    expect_exact(m, total);
  }
  EXPECT_GT(samples_then, 100);
  EXPECT_GT(total.hits, 3000);
}

TEST(HardCases, TrianglesThatTurnEdgeOnOrFlipWithinTheShutterAreExactAndShowTheSideTheyHaveThen) {
  Random random(3);
  Comparison total;
  int positive = 0, negative = 0;
  for (int trial = 0; trial < 24; ++trial) {
    MethodMesh m;
    m.effects = {true, trial % 3 == 0};
    m.settings.orthographic = trial % 4 == 3;
    m.settings.inverse_focus = 0.4f;
    m.lens_radius = m.effects.lens ? 4.0f : 0.0f;
    m.resize(4);
    // Two corners stay, two change sides; depths change, so that it is seen edge-on at another time everywhere.
    for (std::size_t v = 0; v < 4; ++v) {
      m.place(v, 12 + random.uniform(-9, 9), v < 2 ? 8 + random.uniform(-1, 1) : 8 + random.uniform(3, 8),
              random.uniform(1, 3));
      m.move(v, random.uniform(-2, 2), v < 2 ? random.uniform(-1, 1) : random.uniform(-16, -6), random.uniform(1, 3));
    }
    m.add_only_cell({0, 1, 2, 3});
    m.time_bits = 16;
    m.finish({0, 0, 24, 16}, 16);
    expect_exact(m, total);
    m.settings.limits.keep_negative = false;
    positive += static_cast<int>(hits_by_class(m).size());
    expect_exact(m, total);
    m.settings.limits = {};
    m.settings.limits.keep_positive = false;
    negative += static_cast<int>(hits_by_class(m).size());
    expect_exact(m, total);
  }
  EXPECT_GT(positive, 1000);
  EXPECT_GT(negative, 1000);
  EXPECT_LT(total.too_close, total.hits / 100);
}

// ---- Extremes of motion, lens and depth -------------------------------------------------------------------------

TEST(HardCases, MotionOfWholeScreensIsExact) {
  Random random(4);
  Comparison total;
  for (int trial = 0; trial < 12; ++trial) {
    MethodMesh m;
    m.effects = {true, trial % 3 == 0};
    m.settings.orthographic = trial % 4 == 3;
    m.settings.inverse_focus = 0.3f;
    m.lens_radius = m.effects.lens ? 20.0f : 0.0f;
    constexpr int kSide = 6;
    m.resize((kSide + 1) * (kSide + 1));
    // From one end of the guard band towards the other, over the tile half-way; nearer to the camera or farther.
    const float way_x = random.uniform(4000, 14000) * (random.coin() ? 1.0f : -1.0f),
                way_y = random.uniform(-6000, 6000),
                approach = m.settings.orthographic ? 1.0f : random.uniform(0.8f, 1.25f);
    for (std::size_t v = 0; v < m.mesh.vertex_count; ++v) {
      const auto i = static_cast<float>(v % (kSide + 1)), j = static_cast<float>(v / (kSide + 1));
      m.place(v, 1000 - 0.5f * way_x + 150 * (i - 3) + random.uniform(-30, 30),
              700 - 0.5f * way_y + 150 * (j - 3) + random.uniform(-30, 30), 2 + 0.1f * i);
      m.move(v, way_x, way_y, approach * (2 + 0.1f * i));
    }
    m.add_grid_cells(kSide);
    m.time_bits = 16;
    m.finish({990, 690, 1014, 706}, 4);
    expect_exact(m, total);
  }
  EXPECT_GT(total.hits, 500);
  // Half a sample's time of 2^-16 is a tenth of a pixel here, and single precision a thousandth.
  EXPECT_LT(total.too_close, total.hits / 20);
}

TEST(HardCases, FocusAtInfinityIsExact) {
  Random random(5);
  Comparison total;
  int wrong = 0;
  for (int trial = 0; trial < 8; ++trial) {
    MethodMesh m = random_mesh(random, {{trial % 2 == 0, true}, trial % 4 == 3, trial % 3 == 0});
    m.settings.inverse_focus = 0;
    m.finish(m.samples.pixels, m.samples.spp);
    expect_exact(m, total);
    // The twin: focused at 2.5.
    const auto found = hits_by_class(m);
    m.settings.inverse_focus = 0.4f;
    wrong += compare_with_exact(m, found).wrong;
  }
  EXPECT_GT(total.hits, 2000);
  EXPECT_LT(total.too_close, total.hits / 50);
  EXPECT_GT(wrong, 100);
}

TEST(HardCases, HitsAtTheNearAndTheFarPlaneAreExact) {
  // Surfaces that cross both planes in space and in time.
  Random random(6);
  Comparison total;
  int cut = 0;
  for (int trial = 0; trial < 10; ++trial) {
    MethodMesh m = random_mesh(random, {{trial % 2 == 0, trial % 3 == 0}, trial % 4 == 3, trial % 3 == 1});
    const std::size_t all = hits_by_class(m).size();
    m.settings.limits.near = 1.7f;
    m.settings.limits.far = 2.3f;
    cut += static_cast<int>(all - hits_by_class(m).size());
    expect_exact(m, total);
  }
  EXPECT_GT(total.hits, 300);
  EXPECT_GT(cut, 300);
  // Exactly at the planes: a surface at depth 2 is there when near or far is 2, and not when they are one step away.
  for (const bool motion : {false, true}) {
    MethodMesh m = sheet_of_ties({motion, true}, false, 2, 2);
    const std::size_t all = m.samples.count;
    const auto hits_between = [&](float near, float far) {
      m.settings.limits.near = near;
      m.settings.limits.far = far;
      const auto hits = hits_by_class(m);
      expect_all_methods_find(m, hits);
      return hits.size();
    };
    const float after = std::nextafter(2.0f, 3.0f), before = std::nextafter(2.0f, 1.0f);
    EXPECT_EQ(hits_between(2, 2), all);
    EXPECT_EQ(hits_between(after, 3), 0u);
    EXPECT_EQ(hits_between(1, before), 0u);
  }
}

TEST(HardCases, AMillionUnitsAwayAtTheEndOfTheGuardBandIsExact) {
  Random random(7);
  Comparison total;
  for (int trial = 0; trial < 8; ++trial) {
    MethodMesh m = random_mesh(
        random, {{true, trial % 2 == 0}, trial % 4 > 1, false, 16000, 15000, 1e6f, {16000, 15000, 16024, 15016}});
    expect_exact(m, total);
  }
  EXPECT_GT(total.hits, 500);
  EXPECT_LT(total.too_close, total.hits / 10);
}

}  // namespace
}  // namespace tessera::tilecore::hard_cases_test
