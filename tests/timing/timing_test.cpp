// The timing and the energy model on frames whose answer is known.
#include <random>

#include "gpu/configuration.h"
#include "hardware/energy.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"
#include "timing/timing_model.h"

namespace tessera::timing::timing_test {
namespace {

// A machine in which everything is so fast that only the part that a test slows down takes time.
hardware::Machine instant_machine(std::int64_t cores = 1) {
  hardware::Machine gpu = test::coarse_machine();
  gpu.cores.count = cores;
  gpu.cores.memory_bytes = 1 << 20;
  gpu.rates.fill(1e30);
  gpu.set_bytes_per_clk(1e30);
  gpu.shader.lanes = 1;
  gpu.shader.operations = 0;
  gpu.memory.gpu_share = 1;
  gpu.set_latency_clk(0);
  return gpu;
}

// Tiles that need `tests` triangle tests, `runs` pixel-shader invocations and `bytes` stored bytes each. Two tiles fit in the
// memory.
FrameWork tiles(std::size_t count, std::uint64_t tests, std::uint64_t runs, std::uint64_t bytes) {
  FrameWork work;
  work.tile_state_bytes = (1 << 20) / 2;
  work.rounds.emplace_back();
  for (std::size_t i = 0; i < count; ++i) {
    TileWork tile;
    tile.tile = static_cast<std::uint32_t>(i);
    tile.events[Event::kTriangleTests] = tile.events[Event::kTriangleLanes] = tests;
    tile.events[Event::kShaderInvocations] = tile.events[Event::kShaderLanes] = runs;
    tile.dram_bytes[2] = bytes;
    work.rounds[0].tiles.push_back(tile);
  }
  return work;
}

double cycles(const hardware::Machine& gpu, const FrameWork& work) { return schedule_frame(gpu, work).cycles; }

TEST(Timing, OneSlowUnitTakesItsWorkOverItsThroughputAndBoundsTheFrame) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = 4;
  const FrameWork work = tiles(10, 1000, 0, 0);
  EXPECT_DOUBLE_EQ(cycles(gpu, work), 10 * 1000 / 4.0);
  const FrameTiming timing = time_frame(gpu, work, schedule_frame(gpu, work));
  EXPECT_EQ(timing.bound_by, bound_of(Stage::kTriangleTests));
  EXPECT_DOUBLE_EQ(timing.bound_cycles, 1250);
  EXPECT_DOUBLE_EQ(timing.utilisation(Stage::kTriangleTests), 1);
}

// While a tile is shaded, the next one is tested: the slower phase of the two sets the pace, the other shows once.
TEST(Timing, PhasesOfConsecutiveTilesOverlap) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = 1;
  gpu.shader.operations = 1;
  EXPECT_DOUBLE_EQ(cycles(gpu, tiles(10, 300, 100, 0)), 10 * 300 + 100);
  EXPECT_DOUBLE_EQ(cycles(gpu, tiles(10, 100, 300, 0)), 100 + 10 * 300);
  // The unit that starves for tests is the shader.
  const FrameWork work = tiles(10, 300, 100, 0);
  const FrameTiming timing = time_frame(gpu, work, schedule_frame(gpu, work));
  EXPECT_EQ(timing.bound_by, bound_of(Stage::kTriangleTests));
  EXPECT_DOUBLE_EQ(timing.utilisation(Stage::kShader), 1000.0 / 3100);
}

// The failing twin: a core whose memory holds one tile cannot overlap anything.
TEST(Timing, ACoreWithRoomForOneTileDoesOnePhaseAfterTheOther) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = 1;
  gpu.shader.operations = 1;
  gpu.cores.memory_bytes /= 2;
  EXPECT_DOUBLE_EQ(cycles(gpu, tiles(10, 300, 100, 0)), 10 * (300 + 100));
}

TEST(Timing, EqualTilesOnEqualCoresTakeAnEqualShare) {
  for (const std::int64_t cores : {1, 2, 4, 8}) {
    hardware::Machine gpu = instant_machine(cores);
    gpu.rates[Event::kTriangleLanes] = 1;
    const FrameWork work = tiles(16, 500, 0, 0);
    const Schedule schedule = schedule_frame(gpu, work);
    EXPECT_DOUBLE_EQ(schedule.cycles, 16 * 500 / static_cast<double>(cores));
    EXPECT_DOUBLE_EQ(time_frame(gpu, work, schedule).cores_busy, schedule.cycles);
  }
  // One tile too many keeps one core while the others wait.
  hardware::Machine gpu = instant_machine(4);
  gpu.rates[Event::kTriangleLanes] = 1;
  const FrameWork work = tiles(17, 500, 0, 0);
  EXPECT_DOUBLE_EQ(cycles(gpu, work), 5 * 500);
  EXPECT_DOUBLE_EQ(time_frame(gpu, work, schedule_frame(gpu, work)).cores_busy, 17 * 500 / 4.0);
}

TEST(Timing, AFrameThatMovesMoreThanTheMemoryCanTakesItsBytesOverTheRate) {
  hardware::Machine gpu = instant_machine(4);
  gpu.set_bytes_per_clk(16);
  gpu.memory.gpu_share = 0.5;
  const FrameWork work = tiles(12, 0, 0, 4096);
  EXPECT_NEAR(cycles(gpu, work), 12 * 4096 / 8.0, 1e-6);
  const FrameTiming timing = time_frame(gpu, work, schedule_frame(gpu, work));
  EXPECT_EQ(timing.bound_by, bound_of(Stage::kDram));
  EXPECT_NEAR(timing.bound_cycles, timing.cycles / 2, 1e-6);
  EXPECT_NEAR(timing.utilisation(Stage::kDram), 1, 1e-9);
}

// Two cores: one tile can use 1 byte per clock, the other all it gets. Of 4 bytes per clock it gets 3.
TEST(Timing, WhoNeedsLittleOfTheMemoryIsNotSlowedByWhoNeedsMuch) {
  hardware::Machine gpu = instant_machine(2);
  gpu.set_bytes_per_clk(4);
  gpu.rates[Event::kTriangleLanes] = 1;
  FrameWork work = tiles(2, 0, 0, 0);
  work.rounds[0].tiles[0].events[Event::kTriangleLanes] = 1000;
  work.rounds[0].tiles[0].dram_bytes[0] = 1000;
  work.rounds[0].tiles[1].dram_bytes[0] = 3000;
  const Schedule schedule = schedule_frame(gpu, work);
  EXPECT_NEAR(schedule.tiles[0].phases[0].end, 1000, 1e-6);
  EXPECT_NEAR(schedule.tiles[1].phases[0].end, 1000, 1e-6);
  // Twice as much to move: alone after 1000 cycles, at the full rate.
  work.rounds[0].tiles[1].dram_bytes[0] = 7000;
  EXPECT_NEAR(cycles(gpu, work), 1000 + 4000 / 4.0, 1e-6);
}

TEST(Timing, LatencyShowsOnceWhereTilesOverlapAndEveryTimeWhereTheyDoNot) {
  hardware::Machine gpu = instant_machine();
  gpu.set_latency_clk(100);
  gpu.shader.operations = 1;
  FrameWork work = tiles(5, 0, 1000, 0);
  for (TileWork& tile : work.rounds[0].tiles) tile.sub_patches = 1;
  EXPECT_DOUBLE_EQ(cycles(gpu, work), 300 + 5 * 1000);  // list, record of the sub-patch, record of the patch
  gpu.cores.memory_bytes /= 2;
  EXPECT_DOUBLE_EQ(cycles(gpu, work), 5 * (300 + 1000));
}

TEST(Timing, SortingATilesListComesOnTopOfReadingIt) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kFetchedEntries] = 0.5;
  gpu.rates[Event::kSortSteps] = 4;
  FrameWork work = tiles(1, 0, 0, 0);
  TileWork& tile = work.rounds[0].tiles[0];
  tile.events[Event::kFetchedEntries] = 100;
  tile.events[Event::kSortSteps] = 700;
  tile.sub_patches = 1;
  EXPECT_DOUBLE_EQ(cycles(gpu, work), 200 + 175);
  EXPECT_EQ(energy_events(work).counts[Event::kSortSteps], 700u);
  const hardware::FrameEnergy energy = hardware::frame_energy(gpu, energy_events(work), 0, 0);
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("entry_fetch"),
                   (100 * gpu.pj(Event::kFetchedEntries) + 700 * gpu.energy_pj[Event::kSortSteps]) * 1e-3);
}

// n equal items through units that need c1, c2, c3 for all of them, by moving every item by hand.
TEST(Timing, APipelineEndsWhenItsLastItemHasLeft) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    const std::uint64_t items = 1 + random() % 20;
    std::vector<double> whole;
    for (std::size_t u = 0; u < 1 + random() % 6; ++u) whole.push_back(static_cast<double>(random() % 1000));
    std::vector<double> free_at(whole.size(), 0.0);
    for (std::uint64_t i = 0; i < items; ++i) {
      double at = 0;
      for (std::size_t u = 0; u < whole.size(); ++u)
        at = free_at[u] = std::max(at, free_at[u]) + whole[u] / static_cast<double>(items);
    }
    const std::vector<double> ends = pipeline_ends(whole, items);
    for (std::size_t u = 0; u < whole.size(); ++u)
      EXPECT_NEAR(ends[u], free_at[u], 1e-6 * (1 + free_at[u])) << "seed 7, round " << round << ", unit " << u;
  }
}

FrameWork random_frame(std::mt19937& random, std::size_t count) {
  FrameWork work;
  work.tile_state_bytes = 80 << 10;
  for (int r = 0; r < 2; ++r) {
    WorkRound round;
    round.geometry.patches = random() % 1000 + 1;
    for (const auto& [event, most] : {std::pair{Event::kBounds, 5000},
                                      {Event::kReprojectedBlocks, 9000},
                                      {Event::kDepthTests, 20000},
                                      {Event::kSamplingOperations, 100000}})
      round.geometry.events[event] = random() % static_cast<unsigned>(most);
    for (std::size_t i = 0; i < count; ++i) {
      TileWork t;
      t.tile = static_cast<std::uint32_t>(i);
      const auto some = [&] { return random() % 3 == 0 ? 0 : random() % 5000; };
      t.events[Event::kFetchedEntries] = some();
      t.sub_patches = some();
      for (const Event event :
           {Event::kVertices, Event::kBoxes, Event::kBoxTests, Event::kTriangleTests, Event::kHits, Event::kBoxLanes,
            Event::kTriangleLanes, Event::kDepthBlocks, Event::kCompactedSamples, Event::kSurfaceLanes,
            Event::kAlphaTests, Event::kShaderInvocations, Event::kShaderLanes, Event::kTexels, Event::kL2Lines,
            Event::kBlendedLayers, Event::kPixels})
        t.events[event] = some();
      for (std::uint64_t& bytes : t.dram_bytes) bytes = random() % 3 == 0 ? 0 : random() % 50000;
      round.tiles.push_back(t);
    }
    work.rounds.push_back(round);
  }
  work.other_bytes = random() % 100000;
  return work;
}

// Invariants TM1, TM2 and TM3.
TEST(Timing, NoUnitIsBusyLongerThanTheFrameAndPhasesFollowEachOther) {
  std::mt19937 random(11);
  for (const char* preset : {"small", "middle", "large"}) {
    const hardware::Machine gpu = test::coarse_machine<hardware::Machine>(gpu::load_gpu(preset));
    for (int round = 0; round < 10; ++round) {
      const FrameWork work = random_frame(random, 40);
      const Schedule schedule = schedule_frame(gpu, work);
      const FrameTiming timing = time_frame(gpu, work, schedule);
      for (std::size_t s = 0; s < kStageCount; ++s)
        EXPECT_LE(timing.busy[s], timing.cycles * (1 + 1e-9)) << name(static_cast<Stage>(s));
      EXPECT_LE(timing.cores_busy, timing.cycles * (1 + 1e-9));
      ASSERT_EQ(schedule.tiles.size(), 80u);
      std::vector<std::array<double, kPhaseCount>> until(static_cast<std::size_t>(gpu.cores.count));
      for (const TileSchedule& tile : schedule.tiles) {
        double last = 0;
        for (std::size_t p = 0; p < kPhaseCount; ++p) {
          EXPECT_LE(last, tile.phases[p].begin);
          EXPECT_LE(until[tile.core][p], tile.phases[p].begin);
          EXPECT_LE(tile.phases[p].begin, tile.phases[p].flow);
          EXPECT_LE(tile.phases[p].flow, tile.phases[p].end);
          const TileWork& tile_work = work.rounds[tile.round].tiles[tile.index];
          const double bytes = static_cast<double>(tile_work.dram_bytes[p]);
          const double length = tile.phases[p].end - tile.phases[p].flow;
          const PhaseCycles phase = phase_cycles(gpu, tile_work, static_cast<Phase>(p));
          EXPECT_GE(length, pipeline_ends(phase.cycles, phase.items).back() * (1 - 1e-9) - 1e-6);
          EXPECT_GE(length, bytes / memory_rate(gpu) * (1 - 1e-9) - 1e-6);
          last = until[tile.core][p] = tile.phases[p].end;
        }
      }
      EXPECT_LE(schedule.tiles.back().phases.back().end, schedule.cycles);
    }
  }
}

TEST(Timing, AMachineWithMoreIsNotSlower) {
  std::mt19937 random(13);
  for (int round = 0; round < 10; ++round) {
    const FrameWork work = random_frame(random, 100);
    const hardware::Machine gpu = test::coarse_machine<hardware::Machine>(gpu::load_gpu("middle"));
    const double before = cycles(gpu, work);
    hardware::Machine more = gpu;
    more.cores.count *= 2;
    EXPECT_LE(cycles(more, work), before);
    more = gpu;
    more.memory.gb_per_s /= 2;
    EXPECT_GE(cycles(more, work), before);
    more = gpu;
    more.memory.latency_ns *= 4;
    EXPECT_GE(cycles(more, work), before);
    more = gpu;
    more.shader.lanes *= 2;
    EXPECT_LE(cycles(more, work), before);
  }
}

FrameTiming timing_of(const hardware::Machine& gpu, const FrameWork& work) {
  return time_frame(gpu, work, schedule_frame(gpu, work));
}

TEST(Timing, NamesBoundsBeyondSingleUnits) {
  hardware::Machine gpu = instant_machine(2);
  gpu.rates[Event::kTriangleLanes] = gpu.rates[Event::kBoxLanes] = 1;
  gpu.shader.operations = 1;
  // Tests and shading keep a core busy alike: neither gains much alone.
  EXPECT_EQ(timing_of(gpu, tiles(40, 300, 300, 0)).bound_by, Bound::kTileCores);
  // One tile that takes as long as a hundred others.
  gpu.cores.count = 4;
  FrameWork work = tiles(40, 10, 0, 0);
  work.rounds[0].tiles.back().events[Event::kTriangleLanes] = 4000;
  const FrameTiming uneven = timing_of(gpu, work);
  EXPECT_EQ(uneven.bound_by, Bound::kImbalance);
  EXPECT_NEAR(uneven.bound_cycles, uneven.cycles - (39 * 10 + 4000) / 4.0, 10);
  // Every tile waits for its bytes, which are few.
  gpu.set_latency_clk(1000);
  work = tiles(40, 10, 0, 0);
  for (TileWork& tile : work.rounds[0].tiles) tile.dram_bytes[0] = 1;
  EXPECT_EQ(timing_of(gpu, work).bound_by, Bound::kLatency);
  // Front end and binner take turns of patches.
  gpu = instant_machine();
  gpu.rates[Event::kBounds] = gpu.rates[Event::kBinnedEntries] = 1;
  work = tiles(1, 10, 0, 0);
  work.rounds[0].geometry.patches = 1;
  work.rounds[0].geometry.events[Event::kBounds] = work.rounds[0].geometry.events[Event::kBinnedEntries] = 1000;
  EXPECT_EQ(timing_of(gpu, work).bound_by, Bound::kGeometry);
}

// The next frame's geometry beside this one's tiles: the longer of the two sets the pace.
TEST(Timing, FramesThatOverlapTakeTheLongerOfGeometryAndTiles) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = gpu.rates[Event::kBounds] = 1;
  FrameWork work = tiles(4, 100, 0, 0);
  work.rounds[0].geometry.patches = 10;
  for (const std::uint64_t bounds : {100, 1000}) {
    work.rounds[0].geometry.events[Event::kBounds] = bounds;
    gpu.queues.overlap = hardware::FrameOverlap::kNone;
    const FrameTiming alone = timing_of(gpu, work);
    EXPECT_DOUBLE_EQ(alone.cycles, static_cast<double>(bounds) + 400);
    EXPECT_DOUBLE_EQ(alone.latency, alone.cycles);
    gpu.queues.overlap = hardware::FrameOverlap::kFrames;
    const FrameTiming together = timing_of(gpu, work);
    EXPECT_DOUBLE_EQ(together.cycles, std::max(static_cast<double>(bounds), 400.0));
    EXPECT_DOUBLE_EQ(together.latency, 2 * together.cycles);
    EXPECT_EQ(together.busy, alone.busy);
    EXPECT_EQ(together.bound_by, bound_of(bounds > 400 ? Stage::kFrontend : Stage::kTriangleTests));
  }
  // Only the first geometry is the next frame's: a second round waits for its own.
  work.rounds.push_back(work.rounds[0]);
  EXPECT_DOUBLE_EQ(timing_of(gpu, work).cycles, 400 + 1000 + 1000.0);
}

// Geometry of a pass beside the tiles of the one before, which it does not need: G1 + T1 + G2 + T2 becomes
// G1 + max(T1, G2) + T2. The twins: one at a time, and geometry that needs them.
TEST(Timing, PassesThatOverlapTakeTheLongerOfGeometryAndTheTilesBefore) {  // RQ1
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = gpu.rates[Event::kBounds] = 1;
  FrameWork work = tiles(4, 100, 0, 0);
  work.passes = {"behind", "main"};
  work.rounds[0].geometry.patches = 10;
  work.rounds[0].geometry.events[Event::kBounds] = 50;
  work.rounds.push_back(work.rounds[0]);
  work.rounds[1].pass = 1;
  for (const std::uint64_t bounds : {100, 1000}) {
    work.rounds[1].geometry.events[Event::kBounds] = bounds;
    const double second = static_cast<double>(bounds);
    const auto cycles = [&](hardware::FrameOverlap overlap, std::uint32_t after) {
      gpu.queues.overlap = overlap;
      work.rounds[1].geometry_after = after;
      return timing_of(gpu, work).cycles;
    };
    using hardware::FrameOverlap;
    EXPECT_DOUBLE_EQ(cycles(FrameOverlap::kNone, 0), 50 + 400 + second + 400);
    EXPECT_DOUBLE_EQ(cycles(FrameOverlap::kPasses, WorkRound::kAllBefore), 50 + 400 + second + 400);
    EXPECT_DOUBLE_EQ(cycles(FrameOverlap::kPasses, 1), 50 + 400 + second + 400);
    EXPECT_DOUBLE_EQ(cycles(FrameOverlap::kPasses, 0), 50 + std::max(400.0, second) + 400);
    // The next frame's first geometry, 50, lies beside the last tiles.
    EXPECT_DOUBLE_EQ(cycles(FrameOverlap::kFrames, 0), std::max(400.0, second) + 400);
    const FrameTiming timing = timing_of(gpu, work);
    ASSERT_EQ(timing.passes.size(), 2u);
    EXPECT_EQ(timing.passes[1].name, "main");
    EXPECT_LT(timing.passes[1].begin, timing.passes[0].end);
    EXPECT_DOUBLE_EQ(timing.passes[1].end, timing.cycles);
  }
}

// Tiles of independent passes fill the cores that the pass before leaves idle at its end: three tiles on two cores, then
// one more. The twin waits for them.
TEST(Timing, TilesOfAPassFillTheTailOfTheOneBefore) {  // RQ1
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = 1;
  gpu.cores.count = 2;
  FrameWork work = tiles(3, 100, 0, 0);
  work.rounds.push_back(tiles(1, 100, 0, 0).rounds[0]);
  work.passes = {"one", "two"};
  work.rounds[1].pass = 1;
  gpu.queues.overlap = hardware::FrameOverlap::kPasses;
  EXPECT_DOUBLE_EQ(timing_of(gpu, work).cycles, 300);
  work.rounds[1].geometry_after = work.rounds[1].tiles_after = 0;
  EXPECT_DOUBLE_EQ(timing_of(gpu, work).cycles, 200);
}

TEST(Timing, AnEmptyFrameTakesNoTimeAndNothingBoundsIt) {
  const FrameWork work;
  const FrameTiming timing = time_frame({}, work, schedule_frame({}, work));
  EXPECT_EQ(timing.cycles, 0);
  EXPECT_FALSE(timing.bound_by);
}

TEST(Timing, FramesAddUpAndTheUnitWithMostToSaveBoundsThemTogether) {
  hardware::Machine gpu = instant_machine();
  gpu.rates[Event::kTriangleLanes] = 1;
  gpu.shader.operations = 1;
  FrameTiming total;
  for (const auto& [tests, runs] : {std::pair{1000, 0}, {0, 3000}, {1500, 0}}) {
    const FrameWork work = tiles(1, static_cast<std::uint64_t>(tests), static_cast<std::uint64_t>(runs), 0);
    total.accumulate(time_frame(gpu, work, schedule_frame(gpu, work)));
  }
  EXPECT_DOUBLE_EQ(total.cycles, 5500);
  EXPECT_EQ(total.bound_by, bound_of(Stage::kShader));
  EXPECT_DOUBLE_EQ(total.bound_cycles, 1500);
}

TEST(Energy, IsEventsTimesTheirEnergyAndBitsAndLeakage) {
  hardware::Machine gpu = test::coarse_machine();
  FrameWork work;
  work.rounds.emplace_back();
  work.rounds[0].geometry.events[Event::kBounds] = 7;
  work.rounds[0].tiles.resize(2);
  work.rounds[0].tiles[0].events[Event::kShaderInvocations] = 3;
  work.rounds[0].tiles[1].events[Event::kShaderInvocations] = 4;
  work.rounds[0].tiles[1].dram_bytes[1] = 1000;
  const hardware::FrameEnergy energy = frame_energy(gpu, energy_events(work), 8500, 6);
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("frontend"), 7 * gpu.energy_pj[Event::kBounds] / 1000);
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("shader"),
                   7 * gpu.shader.operations * gpu.energy_pj[Event::kShaderClocks] / 1000);
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("dram"), 8000 * 12.5 / 1000);
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("leakage"),
                   60e-3 * 10e-6 * 1e9);  // 6 mm2 of 10 mW each, for 8500 cycles of 850 MHz
  EXPECT_DOUBLE_EQ(energy.by_unit_nj.at("resolve"), 0);
}

// Each event counts in exactly one unit: more of one event changes that unit alone.
TEST(Energy, UnitsAddUpToTheTotalAndNoEventIsChargedTwice) {
  std::mt19937 random(5);
  const hardware::Machine gpu = test::coarse_machine<hardware::Machine>(gpu::load_gpu("large"));
  const FrameWork work = random_frame(random, 10);
  const hardware::FrameEnergy before = frame_energy(gpu, energy_events(work), 1e6, 6);
  double sum = 0;
  for (const auto& [unit, nj] : before.by_unit_nj) sum += nj;
  EXPECT_EQ(sum, before.total_nj());
  for (const Event event : hardware::kAllEvents) {
    if (gpu.pj(event) == 0) continue;
    FrameWork more = work;
    more.rounds[0].tiles[0].events[event] += 1000;
    int changed = 0;
    for (const auto& [unit, nj] : frame_energy(gpu, energy_events(more), 1e6, 6).by_unit_nj)
      changed += nj != before.by_unit_nj.at(unit) ? 1 : 0;
    EXPECT_EQ(changed, 1) << name(event);
  }
}

}  // namespace
}  // namespace tessera::timing::timing_test
