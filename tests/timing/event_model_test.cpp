// Frames simulated item by item: machines whose time is known by hand, and laws that hold for all.
#include <rapidcheck/gtest.h>

#include "memory/dram_spec.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"
#include "tests/timing/item.h"
#include "timing/events/event_model.h"
#include "timing/events/memory_layout.h"

namespace tessera::timing::event_model_test {
namespace {

using hardware::Machine;

Machine endless() { return test::endless_machine(); }

// A frame of one tile, which a test fills.
struct OneTile {
  OneTile() { work.rounds.push_back({{}, {TileWork{}}, {TileItems{}}}); }
  TileWork& tile() { return work.rounds[0].tiles[0]; }
  TileItems& items() { return work.rounds[0].items[0]; }
  double cycles(const Machine& gpu) const { return simulate_events(gpu, work).schedule.cycles; }

  FrameWork work;
};

OneTile sub_patches(const std::vector<SubPatchItem>& items) {
  OneTile one;
  one.items().sub_patches = items;
  for (const SubPatchItem& item : items) {
    for (std::size_t e = 0; e < item.events.size(); ++e)
      one.tile().events[hardware::kFirstItemEvent + e] += item.events[e];
    for (std::uint32_t k = 0; k < item.lines; ++k)
      one.items().lines.push_back(1000 + static_cast<std::uint32_t>(one.items().lines.size()));
  }
  return one;
}

TEST(EventModel, OneUnitThatTakesTimeTakesExactlyIts) {  // EM3
  const OneTile one =
      sub_patches({item({{Event::kVertices, 30}}), item({{Event::kVertices, 12}}), item({{Event::kVertices, 7}})});
  Machine gpu = endless();
  gpu.rates[Event::kVertices] = 0.5;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 2 * 49.0);
}

TEST(EventModel, UnitsOfASubPatchArePipelined) {
  std::vector<SubPatchItem> items(10, item({{Event::kVertices, 4}, {Event::kBoxes, 6}, {Event::kTriangleLanes, 2}}));
  Machine gpu = endless();
  gpu.rates[Event::kVertices] = gpu.rates[Event::kBoxes] = gpu.rates[Event::kTriangleLanes] = 1;
  // The first item through all three, then one for each time that the slowest takes.
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 4 + 6 + 2 + 9 * 6.0);
}

// Three units, the last slow for the first item: those before it fill their queues and wait.
TEST(EventModel, ASlowUnitHoldsUpTheUnitsBeforeIt) {
  std::vector<SubPatchItem> items(6, item({{Event::kVertices, 1}, {Event::kBoxes, 1}, {Event::kBoxLanes, 1}}));
  items[0][Event::kBoxLanes] = 100;
  items[5][Event::kVertices] = 50;
  Machine gpu = endless();
  gpu.rates[Event::kVertices] = gpu.rates[Event::kBoxes] = gpu.rates[Event::kBoxLanes] = 1;
  // With room for all, the last item's 50 vertices are evaluated while the first is tested: it ends at 1 + 1 + 100,
  // then come the tests of four more, and the last is there by then.
  gpu.queues.items = 64;
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 102 + 5.0);
  // With room for one between units: item 1 waits for the box tests, 2 stays in the boxes' unit, 3 waits for it, 4 stays
  // in the tessellator. At 102 the tests take 1, the boxes give 2 and take 3, the tessellator gives 4 and takes the last:
  // 50 vertices, one box, one test.
  gpu.queues.items = 1;
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 102 + 52.0);
}

TEST(EventModel, OneRequestOfTheL2AtATime) {
  OneTile one = sub_patches({{.lines = 5}});
  Machine gpu = endless();
  gpu.set_latency_clk(100);
  gpu.queues.l2_latency_clk = 10;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 110.0);  // side by side
  gpu.queues.l2_requests = 1;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 5 * 110.0);
  // The same line five times is one request.
  one.items().lines.assign(5, 77);
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 110.0);
}

TEST(EventModel, OneBankOfTheL2) {
  OneTile one = sub_patches({{.lines = 8}});
  Machine gpu = endless();
  gpu.queues.l2_lines_per_clk = 0.25;
  gpu.queues.l2_banks = 4;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 4.0);  // the second line of each bank waits for the first
  gpu.queues.l2_banks = 1;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 7 * 4.0);
}

TEST(EventModel, TheMemoryMovesOneByteAfterTheOther) {
  OneTile one = sub_patches({{.lines = 4}});
  one.items().list_bytes = 128;
  one.items().record_bytes = 64;
  one.items().written_bytes = 640;
  Machine gpu = endless();
  gpu.set_bytes_per_clk(2);
  gpu.set_latency_clk(50);
  // The list, then its records, then four lines of 64 bytes, then the writes.
  EXPECT_DOUBLE_EQ(one.cycles(gpu), (64 + 50) + (32 + 50) + (4 * 32 + 50) + 320.0);
}

OneTile warps(std::uint32_t count, std::uint32_t lines_each, bool same_lines) {
  OneTile one;
  for (std::uint32_t w = 0; w < count; ++w) {
    one.items().warps.push_back({.lanes = 32, .texels = 32 * (lines_each > 0 ? 1u : 0u), .texel_lines = lines_each});
    for (std::uint32_t k = 0; k < lines_each; ++k)
      one.items().texel_lines.push_back(same_lines ? k : 64 * one.items().warps.size() + k);
  }
  one.tile().events[Event::kShaderInvocations] = one.tile().events[Event::kShaderLanes] = 32 * count;
  return one;
}

TEST(EventModel, WarpsWithoutLookupsFillTheLanes) {  // EM3
  Machine gpu = endless();
  gpu.shader.operations = 100;
  gpu.shader.lanes = 16;
  EXPECT_DOUBLE_EQ(warps(7, 0, true).cycles(gpu), 7 * 100 * 2.0);
}

// The banks of an idle memory: the time of one read, and of a stream of them at most the bus.
TEST(EventModel, BanksFollowTheMemory) {
  Machine gpu = endless();
  gpu.memory.model = hardware::MemoryModel::kBanks;
  gpu.memory.type = hardware::MemoryType::kLpddr5_6400;
  gpu.clock_mhz = 500;
  const memory::DramSpec spec = memory::dram_spec("lpddr5-6400");
  const double clk = gpu.clock_mhz / spec.clock_mhz();
  const double one = sub_patches({{.lines = 1}}).cycles(gpu);
  EXPECT_NEAR(one, spec.idle_latency_clocks() * clk, 4 * clk);
  OneTile many = sub_patches({{.lines = 4000}});
  gpu.queues.fetched_lines = 4096;
  gpu.queues.l2_requests = 4096;
  const double bytes_per_clk = spec.peak_gb_s() * 1e3 / gpu.clock_mhz;
  const EventSchedule out = simulate_events(gpu, many.work);
  EXPECT_GE(out.schedule.cycles, 4000 * 64 / bytes_per_clk);
  EXPECT_LE(out.schedule.cycles, 1.3 * 4000 * 64 / bytes_per_clk + one);
  EXPECT_GT(out.counts.memory.row_hits, 3000u);
}

// Half the channels, half the rate.
TEST(EventModel, BanksHaveTheChannelsOfTheMachine) {
  Machine gpu = endless();
  gpu.memory.model = hardware::MemoryModel::kBanks;
  gpu.queues.fetched_lines = gpu.queues.l2_requests = 4096;
  OneTile many = sub_patches({{.lines = 4000}});
  const double four = simulate_events(gpu, many.work).schedule.cycles;
  gpu.memory.channels = 2;
  const double two = simulate_events(gpu, many.work).schedule.cycles;
  EXPECT_GT(two, 1.8 * four);
  EXPECT_LT(two, 2.2 * four);
}

TEST(EventModel, OneWarpWaitsForItsTexels) {
  Machine gpu = endless();
  gpu.shader.operations = 100;
  gpu.shader.lanes = 32;
  gpu.queues.max_warps = 1;
  gpu.queues.texture_latency_clk = 20;
  gpu.set_latency_clk(300);
  // The first warp misses, the others hit; a line takes the texture unit a clock.
  EXPECT_DOUBLE_EQ(warps(5, 1, true).cycles(gpu), 5 * 100 + 300 + 4 * (20 + 1.0));
  // Every warp misses.
  EXPECT_DOUBLE_EQ(warps(5, 1, false).cycles(gpu), 5 * (100 + 300.0));
  // Two warps: while one waits the other computes, but both wait for most of the 300.
  gpu.queues.max_warps = 2;
  const double two = warps(5, 1, false).cycles(gpu);
  EXPECT_LT(two, 5 * (100 + 300.0) - 600);
  // Enough of them hide all waits but one.
  gpu.queues.max_warps = 16;
  EXPECT_GE(warps(50, 1, false).cycles(gpu), 50 * 100.0);
  EXPECT_LE(warps(50, 1, false).cycles(gpu), 50 * 100.0 + 300);
}

TEST(EventModel, PixelsWaitForTheVerticesThatTheyInterpolate) {
  Machine gpu = endless();
  gpu.shader.operations = 100, gpu.shader.surface_operations = 40;
  gpu.shader.lanes = 32;
  gpu.set_latency_clk(300);
  OneTile one = warps(3, 0, true);
  WarpItem& first = one.items().warps[0];
  first.texels = 32, first.texel_lines = 1;
  one.items().texel_lines = {7};
  first.kind = WarpItem::kVertices;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 40 + 300 + 2 * 100.0) << "nothing fills the wait";
  // Vertices do not wait for others.
  one.items().warps[1].kind = WarpItem::kVertices;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 40 + 300 + 100.0);
  // The twin: pixels that evaluate their patches do not wait.
  first.kind = one.items().warps[1].kind = WarpItem::kEvaluating;
  EXPECT_LT(one.cycles(gpu), 140 + 300 + 100.0);
}

TEST(EventModel, RegistersLimitTheWarpsInFlight) {
  Machine gpu = endless();
  gpu.shader.operations = 100;
  gpu.shader.lanes = 32;
  gpu.set_latency_clk(300);
  const auto cycles = [&](std::int64_t registers) {
    gpu.queues.registers = registers;
    return warps(20, 1, false).cycles(gpu);
  };
  gpu.queues.register_bytes = 64 * 4 * 32 * 4;  // four warps of 64 registers
  const double four = cycles(64), one = cycles(256);
  EXPECT_DOUBLE_EQ(one, 20 * 400.0);
  EXPECT_LT(four, 0.5 * one);
  gpu.queues.max_warps = 4;
  EXPECT_DOUBLE_EQ(cycles(16), four);
}

TEST(EventModel, CompiledShadersTakeTheirOwnTime) {
  Machine gpu = endless();
  gpu.shader.operations = 1000;
  gpu.shader.lanes = 16;
  gpu.shader.costs = hardware::ShaderCosts::kCompiled;
  OneTile one = warps(3, 0, true);
  for (std::uint32_t w = 0; w < 3; ++w) one.items().warps[w].clocks = 100 + w;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 2 * (100 + 101 + 102.0));
}

TEST(EventModel, ASmallTextureCacheAsksAgain) {
  OneTile one = warps(64, 16, true);
  Machine gpu = endless();
  gpu.caches.texture_bytes = 16 << 10;
  EXPECT_EQ(simulate_events(gpu, one.work).counts.texture_misses, 16u);
  gpu.caches.texture_bytes = 256;  // four lines: the sixteen of each warp push each other out
  EXPECT_EQ(simulate_events(gpu, one.work).counts.texture_misses, 64u * 16u);
}

// The texture cache belongs to a core and stays warm: as many cores, as many times each line.
TEST(EventModel, EachCoreReadsItsOwnTexels) {
  OneTile one = warps(4, 16, true);
  for (int t = 1; t < 8; ++t) {
    one.work.rounds[0].tiles.push_back(one.tile());
    one.work.rounds[0].items.push_back(one.items());
  }
  Machine gpu = endless();
  gpu.shader.operations = 10;
  for (const std::int64_t cores : {1, 2, 4}) {
    gpu.cores.count = cores;
    const SimulationCounts counts = simulate_events(gpu, one.work).counts;
    EXPECT_EQ(counts.texture_misses, static_cast<std::uint64_t>(16 * cores));
    EXPECT_EQ(counts.memory.l2_misses, 16u);
  }
}

// A frame again with caches that hold all of it asks the memory for nothing.
TEST(EventModel, WarmCachesHoldTheFrameBefore) {
  const OneTile one = warps(64, 16, false);
  Machine gpu = endless();
  gpu.caches.l2_bytes = 8 << 20;
  gpu.caches.l2_ways = 16;
  WarmCaches caches;
  const SimulationCounts first = simulate_events(gpu, one.work, &caches).counts,
                         again = simulate_events(gpu, one.work, &caches).counts;
  EXPECT_EQ(first.memory.l2_misses, 64u * 16u);
  EXPECT_GT(again.memory.l2_requests, 0u);
  EXPECT_EQ(again.memory.l2_misses, 0u);
  EXPECT_EQ(simulate_events(gpu, one.work).counts.memory.l2_misses, 64u * 16u);
}

TEST(EventModel, StoresWaitWhereTooManyBytesDo) {
  OneTile one;
  one.tile().events[Event::kPixels] = 1024;  // 16 blocks
  one.items().written_bytes = 16 * 512;
  Machine gpu = endless();
  gpu.rates[Event::kPixels] = 1;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 1024.0);
  gpu.set_bytes_per_clk(4);      // 128 clocks for a block that is resolved in 64
  gpu.queues.store_bytes = 512;  // a block waits while the next is resolved
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 64 + 16 * 128.0);
  gpu.queues.store_bytes = 64;  // none does
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 16 * (64 + 128.0));
}

// EM4: parts of the path against the length of the frame.
::testing::AssertionResult path_adds_up(const PathTime& path, double cycles) {
  double sum = 0;
  for (const double clk : path.clk) {
    if (clk < 0) return ::testing::AssertionFailure() << "a part of " << clk;
    sum += clk;
  }
  if (std::abs(sum - cycles) <= 1e-9 * cycles + 1e-6) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << sum << " of " << cycles << " cycles";
}

PathTime path_of(const OneTile& one, const Machine& gpu) {
  const EventSchedule out = simulate_events(gpu, one.work, nullptr, true);
  EXPECT_TRUE(path_adds_up(out.counts.path, out.schedule.cycles));
  return out.counts.path;
}

TEST(EventModel, ThePathSaysWhereTheTimeWent) {  // EM4
  Machine gpu = endless();
  gpu.set_latency_clk(100);
  gpu.queues.l2_latency_clk = 10;
  gpu.queues.l2_requests = 1;
  OneTile one = sub_patches({{.lines = 5}});
  EXPECT_DOUBLE_EQ(path_of(one, gpu)[Bound::kLatency], 5 * 110.0);
  // List, records, lines, then the writes: the bytes are the memory's time, the waits before them latency.
  one = sub_patches({{.lines = 4}});
  one.items().list_bytes = 128;
  one.items().record_bytes = 64;
  one.items().written_bytes = 640;
  gpu = endless();
  gpu.set_bytes_per_clk(2);
  gpu.set_latency_clk(50);
  PathTime path = path_of(one, gpu);
  EXPECT_DOUBLE_EQ(path[bound_of(Stage::kDram)], 64 + 32 + 4 * 32 + 320.0);
  EXPECT_DOUBLE_EQ(path[Bound::kLatency], 3 * 50.0);
  // The slow unit has the path but for the first and the last item's way.
  gpu = endless();
  gpu.rates[Event::kVertices] = gpu.rates[Event::kBoxes] = gpu.rates[Event::kTriangleLanes] = 1;
  path = path_of(sub_patches(std::vector<SubPatchItem>(
                     10, item({{Event::kVertices, 4}, {Event::kBoxes, 6}, {Event::kTriangleLanes, 2}}))),
                 gpu);
  EXPECT_DOUBLE_EQ(path[bound_of(Stage::kBoxes)], 10 * 6.0);
  EXPECT_DOUBLE_EQ(path[bound_of(Stage::kTessellator)], 4.0);
  EXPECT_DOUBLE_EQ(path[bound_of(Stage::kTriangleTests)], 2.0);
  // One bank of the L2 that gives a line in four clocks.
  gpu = endless();
  gpu.queues.l2_lines_per_clk = 0.25;
  gpu.queues.l2_banks = 1;
  EXPECT_DOUBLE_EQ(path_of(sub_patches({{.lines = 8}}), gpu)[Bound::kL2], 7 * 4.0);
  // Enough warps leave the lanes the path; one waits for each line.
  gpu = endless();
  gpu.shader.operations = 100;
  gpu.set_latency_clk(300);
  EXPECT_GE(path_of(warps(50, 1, false), gpu)[bound_of(Stage::kShader)], 50 * 100.0 - 300);
  gpu.queues.max_warps = 1;
  EXPECT_NEAR(path_of(warps(5, 1, false), gpu)[Bound::kLatency], 5 * 300.0, 5);
}

// The twin: a part that is counted twice shows.
TEST(EventModel, APathWithAPartTooManyDoesNotAddUp) {  // EM4
  Machine gpu = endless();
  gpu.set_latency_clk(100);
  const EventSchedule out = simulate_events(gpu, sub_patches({{.lines = 5}}).work, nullptr, true);
  PathTime twice = out.counts.path;
  twice[Bound::kLatency] += 0.01;
  EXPECT_FALSE(path_adds_up(twice, out.schedule.cycles));
}

// EM5: the cycles of `tile`, and their places.
double cycles_of(const TileSchedule& tile) { return tile.phases.back().end - tile.phases.front().begin; }

// With two tiles in a core, the second one waits for the lanes, which the first one has.
TEST(EventModel, APathOfATileHasItsWaitsForTilesBeforeIt) {  // EM5
  Machine gpu = endless();
  gpu.shader.operations = 100;
  OneTile two = warps(20, 0, false);
  two.work.tile_state_bytes = 1;
  WorkRound& round = two.work.rounds[0];
  round.tiles.push_back(round.tiles[0]);
  round.items.push_back(round.items[0]);
  const EventSchedule out = simulate_events(gpu, two.work, nullptr, true);
  ASSERT_EQ(out.schedule.tiles.size(), 2u);
  for (const TileSchedule& tile : out.schedule.tiles) EXPECT_TRUE(path_adds_up(tile.path, cycles_of(tile)));
  const TileSchedule& second = out.schedule.tiles[1];
  EXPECT_GT(second.phases[1].begin - second.phases[0].end, 1000) << "it waits";
  EXPECT_GT(second.path[bound_of(Stage::kShader)], 0.9 * cycles_of(second));
  // Unrecorded it is empty, and the twin does not add up.
  EXPECT_EQ(simulate_events(gpu, two.work).schedule.tiles[1].path.total(), 0);
  EXPECT_FALSE(path_adds_up(PathTime(), cycles_of(second)));
}

// The bound of a frame is found among the doublings that its path leaves open.
TEST(EventModel, NamesTheBound) {
  const auto bound = [](const Machine& gpu, const OneTile& one) { return time_events(gpu, one.work).timing.bound_by; };
  Machine gpu = endless();
  gpu.shader.operations = 100;
  gpu.set_latency_clk(300);
  gpu.set_bytes_per_clk(64);
  EXPECT_EQ(bound(gpu, warps(200, 1, false)), bound_of(Stage::kShader));
  gpu.queues.max_warps = 1;
  EXPECT_EQ(bound(gpu, warps(200, 1, false)), Bound::kLatency);
  gpu.queues.max_warps = 16;
  gpu.set_bytes_per_clk(0.2);
  EXPECT_EQ(bound(gpu, warps(200, 1, false)), bound_of(Stage::kDram));
  // Sixteen lines again and again, of which the cache holds eight.
  gpu.set_bytes_per_clk(1);
  gpu.caches.texture_bytes = 512;
  gpu.caches.l2_bytes = 0;
  EXPECT_EQ(bound(gpu, warps(200, 16, true)), Bound::kCaches);
}

TEST(EventModel, FramesThatOverlapTakeTheLongerOfGeometryAndTiles) {
  OneTile one = sub_patches({item({{Event::kVertices, 400}})});
  GeometryWork& geometry = one.work.rounds[0].geometry;
  geometry.patches = 320;
  Machine gpu = endless();
  gpu.rates[Event::kVertices] = gpu.rates[Event::kBounds] = 1;
  for (const std::uint64_t bounds : {100, 1000}) {
    geometry.events[Event::kBounds] = bounds;
    gpu.queues.overlap = hardware::FrameOverlap::kNone;
    EXPECT_NEAR(one.cycles(gpu), static_cast<double>(bounds) + 400, 1e-9);
    gpu.queues.overlap = hardware::FrameOverlap::kFrames;
    const EventSchedule out = simulate_events(gpu, one.work, nullptr, true);
    EXPECT_NEAR(out.schedule.cycles, std::max(static_cast<double>(bounds), 400.0), 1e-9);
    EXPECT_NEAR(out.schedule.geometry[0].end, static_cast<double>(bounds), 1e-9);
    EXPECT_TRUE(path_adds_up(out.counts.path, out.schedule.cycles));
  }
}

TEST(EventModel, PassesThatOverlapTakeTheLongerOfGeometryAndTheTilesBefore) {  // RQ1
  Machine gpu = endless();
  gpu.rates[Event::kVertices] = gpu.rates[Event::kBounds] = 1;
  OneTile one = sub_patches({item({{Event::kVertices, 400}})});
  std::vector<WorkRound>& rounds = one.work.rounds;
  rounds[0].geometry.patches = 320, rounds[0].geometry.events[Event::kBounds] = 50;
  rounds.push_back(rounds[0]);
  for (const double second : {100.0, 1000.0}) {
    using hardware::FrameOverlap;
    rounds[1].geometry.events[Event::kBounds] = static_cast<std::uint64_t>(second);
    const auto cycles = [&](FrameOverlap kind, std::uint32_t after) {
      gpu.queues.overlap = kind, rounds[1].geometry_after = after;
      const EventSchedule out = simulate_events(gpu, one.work, nullptr, true);
      EXPECT_TRUE(path_adds_up(out.counts.path, out.schedule.cycles));
      return out.schedule.cycles;
    };
    EXPECT_NEAR(cycles(FrameOverlap::kNone, 0), 50 + 400 + second + 400, 1e-9);
    EXPECT_NEAR(cycles(FrameOverlap::kPasses, WorkRound::kAllBefore), 50 + 400 + second + 400, 1e-9);
    EXPECT_NEAR(cycles(FrameOverlap::kPasses, 0), 50 + std::max(400.0, second) + 400, 1e-9);
    EXPECT_NEAR(cycles(FrameOverlap::kFrames, 0), std::max(400.0, second) + 400, 1e-9);
  }
}

// ---- Vertices on the lanes --------------------------------------------------------------------------------------

Machine endless_with_lanes() {
  Machine gpu = endless();
  gpu.shader.domain = hardware::DomainShading::kLanes;
  gpu.shader.surface_operations = 50;
  return gpu;
}

TEST(EventModel, VerticesTakeTheLanesInWarps) {  // EM3
  Machine gpu = endless_with_lanes();
  gpu.rates[Event::kVertices] = 1e-3;  // of no account
  gpu.shader.lanes = 1;
  // One lane: each of the four warps has 32 times 50 operations, the last with four vertices too.
  EXPECT_DOUBLE_EQ(sub_patches({item({{Event::kVertices, 100}})}).cycles(gpu), 4 * 32 * 50.0);
  gpu.shader.lanes = 16;
  EXPECT_DOUBLE_EQ(sub_patches({item({{Event::kVertices, 100}})}).cycles(gpu), 4 * 2 * 50.0);
  EXPECT_DOUBLE_EQ(
      sub_patches({item({{Event::kVertices, 1}}), item({{Event::kVertices, 0}}), item({{Event::kVertices, 33}})})
          .cycles(gpu),
      3 * 2 * 50.0);
  gpu.shader.costs = hardware::ShaderCosts::kCompiled;
  EXPECT_DOUBLE_EQ(sub_patches({item({{Event::kVertices, 64}}, {.domain_clocks = 70}),
                                item({{Event::kVertices, 5}}, {.domain_clocks = 9})})
                       .cycles(gpu),
                   2 * (2 * 70 + 9.0));
}

// Twice the lanes, half the time; the twin: in a unit of their own vertices have nothing of them.
TEST(EventModel, MoreLanesShadeVerticesSooner) {
  Machine gpu = endless_with_lanes();
  gpu.rates[Event::kVertices] = 0.5;
  const OneTile one = sub_patches(std::vector<SubPatchItem>(6, item({{Event::kVertices, 90}})));
  const auto cycles = [&](std::int64_t lanes, hardware::DomainShading domain) {
    gpu.shader.lanes = lanes, gpu.shader.domain = domain;
    return one.cycles(gpu);
  };
  EXPECT_DOUBLE_EQ(cycles(16, hardware::DomainShading::kLanes), 2 * cycles(32, hardware::DomainShading::kLanes));
  EXPECT_DOUBLE_EQ(cycles(16, hardware::DomainShading::kUnit), 6 * 90 / 0.5);
  EXPECT_DOUBLE_EQ(cycles(32, hardware::DomainShading::kUnit), 6 * 90 / 0.5);
}

// Boxes are built while vertices of the next sub-patches are shaded, of no more than have a place.
TEST(EventModel, TheBoxBuilderHoldsTheLanesUp) {
  Machine gpu = endless_with_lanes();
  gpu.rates[Event::kBoxes] = 1;
  gpu.queues.items = 1;
  std::vector<SubPatchItem> items(4, item({{Event::kVertices, 32}, {Event::kBoxes, 10}}));
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 4 * 50 + 10.0);
  for (SubPatchItem& item : items) item[Event::kBoxes] = 1000;
  items[3][Event::kVertices] = 320;
  // Boxes of the first begin at 50. One sub-patch waits, one stays in the tessellator; the last comes in at 1050, when
  // boxes take the second, and has ten warps of 50.
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 50 + 4 * 1000.0);
  items[3][Event::kVertices] = 32 * 50;
  EXPECT_DOUBLE_EQ(sub_patches(items).cycles(gpu), 1050 + 50 * 50 + 1000.0);
}

TEST(EventModel, HeightsAreLookedUpByTheWarpsThatNeedThem) {
  Machine gpu = endless_with_lanes();
  gpu.rates[Event::kTexels] = 2;
  gpu.set_latency_clk(300);
  gpu.queues.texture_latency_clk = 20;
  OneTile one = sub_patches({item({{Event::kVertices, 32}}, {.domain_texels = 8, .lines = 3, .height_lines = 2})});
  // The record's line, a quarter of the warp; its two lines are there before the 32 x 8 lookups are done.
  gpu.set_latency_clk(100);
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 100 + 50 * 0.25 + (128 + 20) + 50 * 0.75);
  // After them.
  gpu.set_latency_clk(1000);
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 1000 + 50 * 0.25 + 1000 + 50 * 0.75);
  const SimulationCounts counts = simulate_events(gpu, one.work).counts;
  EXPECT_EQ(counts.texture_requests, 2u);
  EXPECT_EQ(counts.memory.l2_requests, 3u);
  EXPECT_EQ(counts.domain.texels, 256u);
}

// One tile has pixels alone, the next vertices, which come as soon as its list is there.
OneTile pixels_then_vertices(std::uint32_t pixel_warps, std::uint32_t vertices) {
  OneTile two = warps(pixel_warps, 0, true);
  const OneTile behind = sub_patches({item({{Event::kVertices, vertices}}, {.domain_registers = 64})});
  for (WarpItem& warp : two.items().warps) warp.registers = 16;
  two.work.tile_state_bytes = 1;
  two.work.rounds[0].tiles.push_back(behind.work.rounds[0].tiles[0]);
  two.work.rounds[0].items.push_back(behind.work.rounds[0].items[0]);
  two.work.rounds[0].items[1].list_bytes = 64;
  return two;
}

TEST(EventModel, VerticesGoBeforePixels) {
  Machine gpu = endless_with_lanes();
  gpu.shader.operations = 100;
  gpu.set_latency_clk(10);
  const OneTile two = pixels_then_vertices(10, 64);
  Schedule out = simulate_events(gpu, two.work).schedule;
  EXPECT_DOUBLE_EQ(out.tiles[1].phases[0].end, 100 + 2 * 50.0);
  EXPECT_DOUBLE_EQ(out.cycles, 10 * 100 + 2 * 50.0);
  // They have no more warps than there are.
  gpu.queues.max_warps = 1;
  EXPECT_DOUBLE_EQ(simulate_events(gpu, two.work).schedule.cycles, 10 * 100 + 2 * 50.0);
}

// A warp of many registers waits until pixels give them back, and is not overtaken meanwhile.
TEST(EventModel, RegistersLimitWarpsOfVertices) {
  Machine gpu = endless_with_lanes();
  gpu.shader.operations = 100;
  gpu.set_latency_clk(10);
  gpu.shader.costs = hardware::ShaderCosts::kCompiled;
  gpu.queues.register_bytes = 64 * 4 * 32;  // one warp of vertices, or four of pixels
  OneTile two = pixels_then_vertices(20, 64);
  for (WarpItem& warp : two.items().warps) warp.clocks = 100;
  two.work.rounds[0].items[1].sub_patches[0].domain_clocks = 50;
  const Schedule out = simulate_events(gpu, two.work).schedule;
  // Four pixel warps were in flight, which end at 400.
  EXPECT_DOUBLE_EQ(out.tiles[1].phases[0].end, 400 + 2 * 50.0);
  EXPECT_DOUBLE_EQ(out.cycles, 20 * 100 + 2 * 50.0);
}

// The lanes' time equals their charge.
TEST(EventModel, LanesAreBusyWithVerticesAndPixels) {
  Machine gpu = endless_with_lanes();
  gpu.shader.operations = 100;
  gpu.set_latency_clk(10);
  const EventSchedule out = simulate_events(gpu, pixels_then_vertices(10, 64).work, nullptr, true);
  EXPECT_DOUBLE_EQ(out.counts.domain.lanes_busy, 2 * 50.0);
  EXPECT_DOUBLE_EQ(out.busy[static_cast<std::size_t>(Stage::kShader)], 10 * 100 + 2 * 50.0);
  EXPECT_TRUE(path_adds_up(out.counts.path, out.schedule.cycles));
  EXPECT_EQ(time_events(gpu, pixels_then_vertices(10, 64).work).timing.bound_by, bound_of(Stage::kShader));
}

// Signatures of inputs are hashed beside the binner's appends, signatures of colours beside the resolve.
TEST(EventModel, HashingTakesItsBytesOverItsRate) {  // EM3
  OneTile one;
  one.work.rounds[0].geometry.patches = 320;
  one.work.rounds[0].geometry.events[Event::kBinnedEntries] = 500;
  one.work.rounds[0].geometry.events[Event::kHashedInputs] = 24000;
  one.tile().events[Event::kPixels] = 1024;
  one.tile().events[Event::kHashedColors] = 4096;
  Machine gpu = endless();
  gpu.rates[Event::kBinnedEntries] = 1;
  gpu.rates[Event::kPixels] = 4;
  gpu.rates[Event::kHashedInputs] = 8;
  gpu.rates[Event::kHashedColors] = 2;
  EXPECT_NEAR(one.cycles(gpu), 24000 / 8.0 + 4096 / 2.0, 1e-9);
  EXPECT_NEAR(schedule_frame(gpu, one.work).cycles, 24000 / 8.0 + 4096 / 2.0, 1e-9);
  // Fast enough, they take no time of their own.
  gpu.rates[Event::kHashedInputs] = 64;
  gpu.rates[Event::kHashedColors] = 16;
  EXPECT_NEAR(one.cycles(gpu), 500 + 256.0, 1e-9);
  EXPECT_NEAR(schedule_frame(gpu, one.work).cycles, 500 + 256.0, 1e-9);
  gpu = Machine();
  const auto nj = hardware::frame_energy(gpu, energy_events(one.work), 0, 0).by_unit_nj;
  EXPECT_NEAR(nj.at("binner"),
              (500 * gpu.energy_pj[Event::kBinnedEntries] + 24000 * gpu.energy_pj[Event::kHashedInputs]) * 1e-3, 1e-9);
  EXPECT_NEAR(nj.at("resolve"),
              (1024 * gpu.energy_pj[Event::kPixels] + 4096 * gpu.energy_pj[Event::kHashedInputs]) * 1e-3, 1e-9);
}

// Lines of tables, one at a time or side by side, and then from the L2.
TEST(EventModel, TheFrontEndReadsTablesThroughTheL2) {
  OneTile one;
  WorkRound& round = one.work.rounds[0];
  round.geometry.patches = 32;
  round.geometry_lines = {7, 8, 9, 7};
  round.geometry.table_bytes = 3 * 64;
  round.geometry.dram_bytes = 5 * 64;  // two more past the L2
  Machine gpu = endless();
  gpu.set_latency_clk(100);
  gpu.queues.l2_latency_clk = 10;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 110.0);
  gpu.queues.table_lines = 1;
  EXPECT_DOUBLE_EQ(one.cycles(gpu), 3 * 110 + 10.0);
  const EventSchedule out = simulate_events(gpu, one.work, nullptr, true);
  EXPECT_EQ(out.counts.memory.read_bytes, 5u * 64u);
  EXPECT_EQ(out.counts.memory.l2_requests, 4u);
  EXPECT_TRUE(path_adds_up(out.counts.path, out.schedule.cycles));
}

// A frame of everything, at random.
FrameWork random_frame(test::Random& random) {
  FrameWork work;
  const auto upto = [&](int most) { return static_cast<std::uint32_t>(random.integer(0, most)); };
  for (int r = random.integer(1, 2); r > 0; --r) {
    WorkRound& round = work.rounds.emplace_back();
    round.geometry.patches = upto(300), round.geometry.events[Event::kBounds] = upto(900),
    round.geometry.events[Event::kBinnedEntries] = upto(2000);
    round.geometry.events[Event::kTestedTiles] = upto(4000), round.geometry.dram_bytes = 64 * upto(400);
    if (round.geometry.patches == 0) round.geometry = {};
    round.geometry.written_bytes = round.geometry.dram_bytes / 128 * 64;
    round.geometry.table_bytes = (round.geometry.dram_bytes - round.geometry.written_bytes) / 128 * 64;
    for (std::uint64_t k = round.geometry.table_bytes / 64; k > 0; --k) round.geometry_lines.push_back(upto(3000));
    for (int t = random.integer(0, 12); t > 0; --t) {
      TileWork& tile = round.tiles.emplace_back();
      TileItems& items = round.items.emplace_back();
      tile.events[Event::kFetchedEntries] = upto(40), tile.events[Event::kSortSteps] = upto(200);
      for (std::uint32_t n = upto(12); n > 0; --n) {
        SubPatchItem item = timing::item({{Event::kVertices, upto(80)}, {Event::kTransforms, upto(40)}});
        item[Event::kBoxes] = upto(80), item[Event::kBoxLanes] = upto(900), item[Event::kStencilTests] = upto(500);
        item[Event::kTriangleLanes] = upto(900), item[Event::kAlphaTests] = upto(40),
        item[Event::kDepthBlocks] = upto(4);
        item.domain_clocks = upto(500), item.domain_registers = 1 + upto(100), item.domain_texels = 8 * upto(1);
        item.lines = upto(6), item.height_lines = item.lines / 2;
        for (std::uint32_t k = 0; k < item.lines; ++k) items.lines.push_back(upto(3000));
        if (random.coin()) item.texel_lines = upto(8);
        for (std::uint32_t k = 0; k < item.texel_lines; ++k) items.texel_lines.push_back(5000 + upto(600));
        tile.events[Event::kVertices] += item[Event::kVertices],
            tile.events[Event::kTransforms] += item[Event::kTransforms],
            tile.events[Event::kBoxes] += item[Event::kBoxes];
        tile.events[Event::kBoxLanes] += item[Event::kBoxLanes],
            tile.events[Event::kStencilTests] += item[Event::kStencilTests];
        tile.events[Event::kTriangleLanes] += item[Event::kTriangleLanes],
            tile.events[Event::kAlphaTests] += item[Event::kAlphaTests];
        tile.events[Event::kDepthBlocks] += item[Event::kDepthBlocks];
        items.sub_patches.push_back(item);
      }
      items.shading_lines = upto(10);
      for (std::uint32_t k = 0; k < items.shading_lines; ++k) items.lines.push_back(upto(3000));
      for (std::uint32_t n = upto(20); n > 0; --n) {
        WarpItem warp{1 + upto(31), upto(1), 1 + upto(500), 1 + upto(100), 0, upto(12)};
        warp.texels = warp.texel_lines > 0 ? 32 + upto(200) : 0;
        for (std::uint32_t k = 0; k < warp.texel_lines; ++k) items.texel_lines.push_back(5000 + upto(600));
        tile.events[Event::kShaderLanes] += 32,
            tile.events[Event::kSurfaceLanes] += (warp.kind == WarpItem::kEvaluating ? 32 : 0),
            tile.events[Event::kTexels] += warp.texels;
        items.warps.push_back(warp);
      }
      tile.events[Event::kPixels] = upto(1024), tile.events[Event::kBlendedLayers] = upto(300);
      items.list_bytes = 64 * upto(6), items.record_bytes = 64 * upto(6), items.load_bytes = 64 * upto(2);
      items.resolve_bytes = 64 * upto(2), items.written_bytes = 64 * upto(80);
    }
  }
  work.tile_state_bytes = 40000;
  work.other_bytes = 64 * upto(100);
  work.other_written_bytes = work.other_bytes / 2;
  return work;
}

RC_GTEST_PROP(MemoryLayout, PartsAndTilesDoNotOverlap, (std::uint32_t seed)) {  // ML1
  test::Random random(seed);
  const FrameWork work = random_frame(random);
  const MemoryLayout layout(work, 64);
  struct Range {
    std::uint64_t begin, end;
  };
  std::vector<Range> ranges;
  std::uint64_t lines = 0, patches = 0;
  std::map<std::uint32_t, std::pair<std::uint64_t, std::uint64_t>> tiles;  // most bytes of list and pixels
  for (const WorkRound& round : work.rounds) {
    patches = std::max(patches, round.geometry.dram_bytes);
    for (std::size_t t = 0; t < round.items.size(); ++t) {
      const TileItems& items = round.items[t];
      for (const auto* numbers : {&items.lines, &items.texel_lines})
        for (const std::uint32_t line : *numbers) lines = std::max(lines, std::uint64_t{line} + 1);
      auto& [list, pixels] = tiles[round.tiles[t].tile];
      list = std::max(list, items.list_bytes + items.load_bytes + items.record_bytes);
      pixels = std::max({pixels, items.written_bytes, items.resolve_bytes});
    }
    for (const std::uint32_t line : round.geometry_lines) lines = std::max(lines, std::uint64_t{line} + 1);
  }
  ranges.push_back({0, 64 * lines});
  ranges.push_back({layout.patches(), layout.patches() + patches});
  ranges.push_back({layout.other(), layout.other() + work.other_bytes});
  for (const auto& [tile, bytes] : tiles) {
    ranges.push_back({layout.list_of(tile), layout.list_of(tile) + bytes.first});
    ranges.push_back({layout.pixels_of(tile), layout.pixels_of(tile) + bytes.second});
  }
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  for (std::size_t i = 1; i < ranges.size(); ++i) RC_ASSERT(ranges[i - 1].end <= ranges[i].begin);
  RC_ASSERT(layout.entries() >= 64 * lines);
}

Machine random_machine(test::Random& random) {
  Machine gpu = test::coarse_machine();
  const auto pick = [&](std::initializer_list<std::int64_t> of) {
    return of.begin()[random.integer(0, static_cast<int>(of.size()) - 1)];
  };
  gpu.queues.model = hardware::TimingModel::kEvents;
  gpu.cores.count = pick({1, 2, 5});
  gpu.queues.items = pick({1, 2, 8});
  gpu.queues.fetched_lines = pick({1, 4, 64});
  gpu.queues.store_bytes = pick({64, 4096});
  gpu.queues.texture_requests = pick({1, 3, 32});
  gpu.queues.l2_requests = pick({1, 2, 64});
  gpu.queues.l2_banks = pick({1, 3, 8});
  gpu.queues.max_warps = pick({1, 2, 16});
  gpu.caches.texture_bytes = pick({256, 4096});
  gpu.caches.l2_bytes = pick({0, 4096, 262144});
  gpu.set_bytes_per_clk(static_cast<double>(pick({2, 40})));
  gpu.memory.model = static_cast<hardware::MemoryModel>(pick({0, 1}));
  gpu.memory.type = static_cast<hardware::MemoryType>(pick({0, 1, 2}));
  gpu.shader.costs = static_cast<hardware::ShaderCosts>(pick({0, 1}));
  gpu.shader.domain = static_cast<hardware::DomainShading>(pick({0, 1}));
  gpu.queues.register_bytes = pick({1024, 131072});
  gpu.cores.memory_bytes = pick({40000, 160000});
  gpu.queues.overlap = static_cast<hardware::FrameOverlap>(pick({0, 1}));
  return gpu;
}

RC_GTEST_PROP(EventModel, BytesAndTilesAreConserved, (std::uint32_t seed)) {  // EM1 EM2
  test::Random random(seed);
  const FrameWork work = random_frame(random);
  const Machine gpu = random_machine(random);
  const EventSchedule out = simulate_events(gpu, work);
  std::uint64_t past_l2 = work.other_bytes, texel_lines = 0, lines = 0;
  DomainCounts domain;  // as it must be
  const bool on_lanes = gpu.shader.domain == hardware::DomainShading::kLanes;
  std::size_t tiles = 0;
  for (const WorkRound& round : work.rounds) {
    past_l2 += round.geometry.dram_bytes - round.geometry.table_bytes;
    lines += round.geometry_lines.size();
    tiles += round.tiles.size();
    for (const TileItems& items : round.items) {
      past_l2 += items.list_bytes + items.record_bytes + items.load_bytes + items.resolve_bytes + items.written_bytes;
      texel_lines += items.texel_lines.size();
      lines += items.lines.size();
      for (const SubPatchItem& item : items.sub_patches) {
        if (!on_lanes) continue;
        domain.vertices += item[Event::kVertices], domain.warps += domain_warps(gpu, item);
        domain.texels += std::uint64_t{item[Event::kVertices]} * item.domain_texels;
        // Without lookups no vertex asks for heights.
        lines -= item.height_lines;
        if (item[Event::kVertices] > 0 && item.domain_texels > 0) texel_lines += item.height_lines;
      }
    }
  }
  const MemoryCounts& memory = out.counts.memory;
  RC_ASSERT(memory.read_bytes + memory.written_bytes == past_l2 + memory.l2_misses * 64);
  RC_ASSERT(out.counts.texture_requests == texel_lines);
  RC_ASSERT(memory.l2_requests == lines + out.counts.texture_misses);
  RC_ASSERT(memory.l2_misses <= memory.l2_requests);
  RC_ASSERT(out.counts.domain.vertices == domain.vertices);
  RC_ASSERT(out.counts.domain.warps == domain.warps);
  RC_ASSERT(out.counts.domain.texels == domain.texels);
  for (const double busy : out.busy) RC_ASSERT(busy <= out.schedule.cycles * (1 + 1e-9) + 1e-6);
  for (const double stall : out.counts.stalls) RC_ASSERT(stall <= out.schedule.cycles * (1 + 1e-9) + 1e-6);
  RC_ASSERT(out.schedule.tiles.size() == tiles);
  for (const TileSchedule& tile : out.schedule.tiles) {
    double last = 0;
    for (const TileSchedule::Span& span : tile.phases) {
      RC_ASSERT(span.begin >= last);
      RC_ASSERT(span.flow >= span.begin);
      RC_ASSERT(span.end >= span.flow);
      last = span.end;
    }
    RC_ASSERT(last <= out.schedule.cycles);
    RC_ASSERT(tile.core < static_cast<std::uint32_t>(gpu.cores.count));
  }
  // The same again, bit by bit, whether its path and its transactions are recorded or not.
  std::vector<memory::Burst> transactions;
  const EventSchedule again =
      simulate_events(gpu, work, nullptr, true, std::numeric_limits<double>::infinity(), &transactions);
  if (!gpu.has_banks()) RC_ASSERT(transactions.empty());
  if (gpu.has_banks()) {
    const std::uint64_t asked = 32 * transactions.size(), moved = memory.read_bytes + memory.written_bytes;
    RC_ASSERT(asked <= moved + 64 * 4 * (tiles + work.rounds.size() + 1) &&
              moved <= asked + 64 * 4 * (tiles + work.rounds.size() + 1));
    RC_ASSERT(std::is_sorted(transactions.begin(), transactions.end(),
                             [](const memory::Burst& a, const memory::Burst& b) { return a.cycle < b.cycle; }));
  }
  RC_ASSERT(again.schedule.cycles == out.schedule.cycles);
  RC_ASSERT(again.counts.events == out.counts.events);
  RC_ASSERT(static_cast<bool>(path_adds_up(again.counts.path, again.schedule.cycles)));
  for (const TileSchedule& tile : again.schedule.tiles)  // EM5
    RC_ASSERT(static_cast<bool>(path_adds_up(tile.path, cycles_of(tile))));
}

}  // namespace
}  // namespace tessera::timing::event_model_test
