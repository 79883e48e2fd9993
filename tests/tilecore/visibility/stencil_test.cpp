// The stencil unit: two references, valid rate, occupancy.
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"

namespace tessera::tilecore::stencil_test {
namespace {

// Samples of a tile with one sample a pixel whose stencil values are the given ones, over and over.
TileSamples timed_samples(const IntRect& tile, const std::vector<int>& stencils) {
  static const SamplePattern pattern({1, 0, 0});
  TileSamples samples;
  samples.fill(pattern, tile, 0, false);
  for (std::size_t i = 0; i < samples.count; ++i)
    samples.time[i] = static_cast<std::uint16_t>(stencils[i % stencils.size()] << 8);
  return samples;
}

// How often each stencil value is kept by k segments of the shutter; `half_open`: the last one, too.
std::array<int, 256> times_kept(int k, bool half_open) {
  std::array<int, 256> kept{};
  for (int i = 0; i < k; ++i) {
    StencilReferences references = StencilReferences::of({256 * i / k, 256 * (i + 1) / k - 1});
    if (half_open) references.closed = false;
    for (int s = 0; s < 256; ++s) kept[static_cast<std::size_t>(s)] += references.keeps(s) ? 1 : 0;
  }
  return kept;
}

TEST(StencilUnit, SegmentsKeepEveryValueExactlyOnceStencil0AndStencil255Included) {  // ST1
  for (int k = 1; k <= 256; ++k) {
    const std::array<int, 256> kept = times_kept(k, false);
    for (std::size_t s = 0; s < 256; ++s) ASSERT_EQ(kept[s], 1) << k << " segments, stencil " << s;
  }
}

TEST(StencilUnit, AHalfOpenLastSegmentIsCaughtLosingTheLastValue) {
  for (const int k : {1, 8, 100}) EXPECT_EQ(times_kept(k, true)[255], 0);
}

TEST(StencilUnit, KeepsInTheOrderOfTheWalkAndCountsGroupsOf32Lanes) {  // ST2
  // Rows of 10 pixels in a tile of 16: 80 samples are two groups and a half.
  const TileSamples samples = timed_samples({8, 8, 24, 24}, {0, 255, 7, 7});
  const IntRect pixels{10, 9, 20, 17};
  StencilUnit unit;
  std::vector<std::uint32_t> kept, expected;
  unit.keep(samples, pixels, {0, 255, true}, kept);
  all_samples(samples, pixels, expected);
  ASSERT_EQ(expected.size(), 80u);
  EXPECT_EQ(expected[0], 16u + 2u);
  EXPECT_EQ(expected[10], 2u * 16u + 2u);
  EXPECT_EQ(kept, expected);
  EXPECT_EQ(unit.counters().lanes_issued, 96u);  // a group that is not full is issued whole
  std::erase_if(expected, [&](std::uint32_t s) { return samples.stencil(s) != 255; });
  unit.take_counters();
  unit.keep(samples, pixels, {8, 255, true}, kept);
  EXPECT_EQ(kept, expected);
  EXPECT_EQ(unit.counters().tests, 80u);
  EXPECT_EQ(unit.counters().kept, expected.size());
  unit.take_counters();
  // One sample of the whole rectangle: one group.
  TileSamples one = timed_samples({8, 8, 24, 24}, {3});
  one.time[2 * 16 + 5] = 200 << 8;
  unit.keep(one, pixels, StencilReferences::of({200, 200}), kept);
  EXPECT_EQ(kept, std::vector<std::uint32_t>{2 * 16 + 5});
  EXPECT_EQ(unit.counters().lanes_issued, 32u);
  EXPECT_EQ(unit.take_counters().kept, 1u);
  EXPECT_EQ(unit.counters().tests, 0u);
}

TEST(StencilUnit, TheStencilIsTheUpperHalfOfATimeAndNeverLaterThanIt) {
  TileSamples samples = timed_samples({0, 0, 4, 1}, {0});
  samples.time = {0xFFFF, 0x00FF, 0x8000, 0x8001};
  samples.half_quantum = 0x1p-17f;  // as of sixteen bits
  for (const auto& [at, stencil] : {std::pair<std::size_t, int>{0, 255}, {1, 0}, {2, 128}, {3, 128}}) {
    EXPECT_EQ(samples.stencil(at), stencil);
    EXPECT_LE(static_cast<float>(stencil) / 256, samples.t(at));
    EXPECT_LT(samples.t(at), static_cast<float>(stencil + 1) / 256);
  }
}

// ---- Valid rate -------------------------------------------------------------------------------------------------

struct Rate {
  double valid;
  std::uint64_t tests;
};

// A square of side 8, a sub-pixel smaller so that its rectangles are whole pixels, that moves 64 pixels along x.
Rate square_moving(int segments, bool one_way_only) {
  MethodMesh m;
  m.effects = {true, false};
  m.resize(4);
  const float e = 1.0f / 128;
  m.place(0, e, e, 1);
  m.place(1, 8 - e, e, 1);
  m.place(2, 8 - e, 8 - e, 1);
  m.place(3, e, 8 - e, 1);
  for (std::size_t v = 0; v < 4; ++v) m.move(v, one_way_only ? 64.0f : 0.0f, 0, 1);
  m.mesh.begin_leaf();
  m.mesh.add_cell({0, 1, 2, 3}, 0);
  m.finish({0, 0, 80, 16}, 4);
  MeshVisibility visibility;
  HitSet sink;
  VisibilityWork work;
  visibility.test(m.in_tile(), {VisibilityMethod::kSegments, segments}, sink, work);
  sink.flush();
  const StencilCounters c = visibility.take_stencil_counters();
  EXPECT_LE(c.hits, c.kept);  // ST3
  EXPECT_LE(c.kept, c.lanes_issued);
  EXPECT_LE(c.kept, c.tests);
  return {static_cast<double>(c.hits) / static_cast<double>(c.kept), c.tests};
}

TEST(StencilUnit, TheValidRateOfAMovingSquareIsSideOverSidePlusWayOfASegment) {
  for (const int k : {1, 2, 4, 8, 16}) EXPECT_NEAR(square_moving(k, true).valid, 8.0 / (8.0 + 64.0 / k), 0.025) << k;
  EXPECT_NEAR(square_moving(1, true).valid, 0.11, 0.01);
  EXPECT_NEAR(square_moving(8, true).valid, 0.50, 0.02);
  EXPECT_GT(square_moving(1, false).valid, 0.98);  // at rest
  // k rectangles of s + L/k against one of s + L.
  EXPECT_EQ(square_moving(1, true).tests, 72u * 8u * 4u);
  EXPECT_EQ(square_moving(8, true).tests, 8u * 16u * 8u * 4u);  // 1.78 times as many
}

}  // namespace
}  // namespace tessera::tilecore::stencil_test
