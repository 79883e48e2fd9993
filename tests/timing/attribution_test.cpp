// Cycles and energy of a frame split by drawables and tiles.
#include <rapidcheck/gtest.h>

#include "hardware/energy.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"
#include "tests/timing/item.h"
#include "timing/attribution.h"
#include "timing/events/event_model.h"

namespace tessera::timing::attribution_test {
namespace {

using hardware::Machine;

FrameTiming timing_of(const Machine& gpu, const FrameWork& work) {
  if (gpu.queues.model == hardware::TimingModel::kEvents) return time_events(gpu, work).timing;
  return time_frame(gpu, work, schedule_frame(gpu, work));
}

hardware::FrameEnergy energy_of(const Machine& gpu, const FrameWork& work, const FrameTiming& timing) {
  return hardware::frame_energy(gpu, energy_events(work), timing.cycles, 3.0);
}

::testing::AssertionResult adds_up(const std::map<std::uint32_t, DrawableShare>& shares, const FrameWork& work,
                                   const FrameTiming& timing, double energy_nj) {
  double cycles = 0, energy = 0;
  std::uint64_t bytes = 0;
  for (const auto& [drawable, share] : shares)
    cycles += share.cycles, energy += share.energy_nj, bytes += share.dram_bytes;
  if (bytes != work.dram_bytes())
    return ::testing::AssertionFailure() << bytes << " of " << work.dram_bytes() << " bytes";
  if (std::abs(cycles - timing.cycles) > 1e-9 * timing.cycles + 1e-6)
    return ::testing::AssertionFailure() << cycles << " of " << timing.cycles << " cycles";
  if (std::abs(energy - energy_nj) > 1e-9 * energy_nj + 1e-6)
    return ::testing::AssertionFailure() << energy << " of " << energy_nj << " nJ";
  return ::testing::AssertionSuccess();
}

// One tile: drawable 1 is tested twice as much as 2, and 2 alone is shaded.
FrameWork two_drawables() {
  FrameWork work;
  WorkRound& round = work.rounds.emplace_back();
  TileWork& tile = round.tiles.emplace_back();
  TileItems& items = round.items.emplace_back();
  items.sub_patches = {item({{Event::kTriangleLanes, 2000}}, {.drawable = 1}),
                       item({{Event::kTriangleLanes, 1000}}, {.drawable = 2})};
  items.warps = {{.lanes = 32, .clocks = 100, .registers = 1, .drawable = 2}};
  tile.events[Event::kTriangleTests] = tile.events[Event::kTriangleLanes] = 3000;
  tile.sub_patches = 2;
  tile.events[Event::kShaderInvocations] = tile.events[Event::kShaderLanes] = 32;
  tile.events[Event::kCompactedSamples] = 32;
  return work;
}

TEST(Attribution, SplitsUnitsByWhoKeptThemBusy) {
  Machine gpu = test::coarse_machine();
  gpu.cores.count = 1;
  gpu.queues.model = hardware::TimingModel::kEvents;
  const FrameWork work = two_drawables();
  const FrameTiming timing = timing_of(gpu, work);
  const hardware::FrameEnergy energy = energy_of(gpu, work, timing);
  const auto shares = attribute(gpu, work, timing, energy);
  ASSERT_EQ(shares.size(), 3u);
  const double tests = timing.events->path[bound_of(Stage::kTriangleTests)];
  EXPECT_DOUBLE_EQ(tests, 3000 / gpu.rates[Event::kTriangleLanes]);
  EXPECT_NEAR(shares.at(1).cycles, tests * 2 / 3, 1e-9);
  EXPECT_NEAR(shares.at(2).cycles, timing.cycles - tests * 2 / 3, 1e-9);
  EXPECT_EQ(shares.at(1).tests, 2000u);
  EXPECT_EQ(shares.at(2).invocations, 32u);
  const double leakage = energy.by_unit_nj.at("leakage") / timing.cycles;
  EXPECT_NEAR(shares.at(1).energy_nj,
              2000 * gpu.energy_pj[Event::kTriangleTests] * 1e-3 + leakage * shares.at(1).cycles, 1e-9);
  EXPECT_TRUE(adds_up(shares, work, timing, energy.total_nj()));
}

// Bytes of geometry go by list entries, bytes before shading by entries and lines, bytes of textures by lines, and
// pixels by invocations; bytes that no tile asked for are not attributed.
TEST(Attribution, SplitsBytesByWhoAskedForThem) {
  const Machine gpu = test::coarse_machine();
  FrameWork work = two_drawables();
  WorkRound& round = work.rounds[0];
  const auto line = static_cast<std::uint64_t>(gpu.line_bytes());
  round.geometry.dram_bytes = 1000, work.other_bytes = 500;
  round.items[0].list_bytes = 2 * line;
  round.items[0].lines = {1, 2, 3};
  round.items[0].sub_patches[0].lines = 3;
  round.items[0].warps.push_back({.lanes = 96, .clocks = 100, .registers = 1, .texel_lines = 1, .drawable = 1});
  round.items[0].texel_lines = {4};
  round.tiles[0].dram_bytes = {5 * line, line, 400};
  EventCounts& events = round.tiles[0].events;
  events[Event::kShaderInvocations] = events[Event::kShaderLanes] = events[Event::kCompactedSamples] = 128;
  const FrameTiming timing = timing_of(gpu, work);
  const hardware::FrameEnergy energy = energy_of(gpu, work, timing);
  const auto shares = attribute(gpu, work, timing, energy);
  EXPECT_EQ(shares.at(0).dram_bytes, 500u);
  EXPECT_EQ(shares.at(1).dram_bytes, 500 + 4 * line + line + 300);
  EXPECT_EQ(shares.at(2).dram_bytes, 500 + line + 100);
  EXPECT_TRUE(adds_up(shares, work, timing, energy.total_nj()));
}

// The twin: an item that is counted for two drawables shows.
TEST(Attribution, AShareTooManyDoesNotAddUp) {  // AT1
  const Machine gpu = test::coarse_machine();
  const FrameWork work = two_drawables();
  const FrameTiming timing = timing_of(gpu, work);
  const hardware::FrameEnergy energy = energy_of(gpu, work, timing);
  auto shares = attribute(gpu, work, timing, energy);
  shares[3] = shares.at(1);
  EXPECT_FALSE(adds_up(shares, work, timing, energy.total_nj()));
}

RC_GTEST_PROP(Attribution, AddsUpToTheFrame, (std::uint32_t seed)) {  // AT1
  test::Random random(seed);
  const auto upto = [&](int most) { return static_cast<std::uint32_t>(random.integer(0, most)); };
  FrameWork work;
  for (std::uint32_t r = 1 + upto(1); r > 0; --r) {
    WorkRound& round = work.rounds.emplace_back();
    if (random.coin())
      round.geometry.patches = 5, round.geometry.events[Event::kBounds] = upto(100), round.geometry.dram_bytes = 640;
    for (std::uint32_t t = upto(6); t > 0; --t) {
      TileWork& tile = round.tiles.emplace_back();
      TileItems& items = round.items.emplace_back();
      tile.tile = upto(20), tile.events[Event::kFetchedEntries] = upto(9), tile.events[Event::kPixels] = upto(300),
      tile.events[Event::kHits] = upto(100);
      tile.dram_bytes = {upto(9999), upto(999), upto(99999)}, items.list_bytes = upto(100);
      for (std::uint32_t n = upto(5); n > 0; --n) {
        SubPatchItem& item = items.sub_patches.emplace_back();
        item.drawable = upto(4), item[Event::kVertices] = upto(50), item[Event::kBoxes] = upto(50),
        item[Event::kBoxLanes] = upto(500);
        item[Event::kTriangleLanes] = upto(500), item[Event::kAlphaTests] = upto(9), item.domain_texels = 8 * upto(1);
        tile.events[Event::kDomainTexels] += std::uint64_t{item[Event::kVertices]} * item.domain_texels;
        tile.events[Event::kVertices] += item[Event::kVertices], tile.events[Event::kBoxes] += item[Event::kBoxes],
            tile.events[Event::kAlphaTests] += item[Event::kAlphaTests];
        tile.events[Event::kBoxLanes] += item[Event::kBoxLanes],
            tile.events[Event::kBoxTests] += item[Event::kBoxLanes] / 2;
        tile.events[Event::kTriangleLanes] += item[Event::kTriangleLanes],
            tile.events[Event::kTriangleTests] += item[Event::kTriangleLanes] / 2;
      }
      for (std::uint32_t n = upto(5); n > 0; --n) {
        items.warps.push_back({.lanes = 1 + upto(31), .clocks = 1 + upto(200), .registers = 8, .drawable = upto(4)});
        tile.events[Event::kShaderLanes] += 32, tile.events[Event::kShaderInvocations] += items.warps.back().lanes;
        tile.events[Event::kCompactedSamples] += items.warps.back().lanes;
      }
    }
  }
  Machine gpu = test::coarse_machine();
  gpu.queues.model = static_cast<hardware::TimingModel>(upto(1));
  gpu.shader.domain = static_cast<hardware::DomainShading>(upto(1));
  const FrameTiming timing = timing_of(gpu, work);
  const hardware::FrameEnergy energy = energy_of(gpu, work, timing);
  RC_ASSERT(static_cast<bool>(adds_up(attribute(gpu, work, timing, energy), work, timing, energy.total_nj())));
}

TEST(Attribution, TilesNameTheirBound) {
  Machine gpu = test::coarse_machine();
  gpu.cores.count = 2;
  gpu.memory.latency_ns = 0;
  FrameWork work = two_drawables();
  work.rounds[0].tiles.push_back(work.rounds[0].tiles[0]);
  work.rounds[0].items.push_back(work.rounds[0].items[0]);
  work.rounds[0].tiles[0].tile = 7;
  work.rounds[0].tiles[1].tile = 3;
  work.rounds[0].tiles[1].dram_bytes = {64, 0, 1 << 20};
  const Schedule schedule = schedule_frame(gpu, work);
  const std::vector<TileShare> tiles = attribute_tiles(gpu, work, schedule);
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].tile, 3u);
  EXPECT_EQ(tiles[0].bound_by, bound_of(Stage::kDram));
  EXPECT_EQ(tiles[0].dram_bytes, 64u + (1 << 20));
  EXPECT_EQ(tiles[1].bound_by, bound_of(Stage::kTriangleTests));
  const double tests = 3000 / gpu.rates[Event::kTriangleLanes];
  EXPECT_GT(tiles[1].bound_cycles, tests / 4);
  EXPECT_LE(tiles[1].bound_cycles, tests / 2 + 1e-9);
  EXPECT_DOUBLE_EQ(tiles[1].cycles, schedule.tiles[0].phases.back().end - schedule.tiles[0].phases.front().begin);
  EXPECT_GT(tiles[1].energy_nj, 0);
  // Three reads follow each other: list, records, heights.
  gpu.memory.latency_ns = 1000;
  const std::vector<TileShare> waiting = attribute_tiles(gpu, work, schedule_frame(gpu, work));
  EXPECT_EQ(waiting[1].bound_by, Bound::kLatency);
  EXPECT_NEAR(waiting[1].bound_cycles, 1.5 * gpu.latency_clk(), 1e-6);
}

// With events the path says the same of a tile that has one unit to wait for, without another simulation.
TEST(Attribution, TheBoundOfATileIsEstimatedByItsPath) {
  Machine gpu = test::coarse_machine();
  gpu.cores.count = 1;
  gpu.queues.model = hardware::TimingModel::kEvents;
  gpu.memory.latency_ns = 0;
  const FrameWork work = two_drawables();
  const Schedule schedule = simulate_events(gpu, work, nullptr, true).schedule;
  const double tests = 3000 / gpu.rates[Event::kTriangleLanes];
  for (const TileBounds way : {TileBounds::kEstimated, TileBounds::kDoubled}) {
    const std::vector<TileShare> tiles = attribute_tiles(gpu, work, schedule, {}, way);
    ASSERT_EQ(tiles.size(), 1u);
    EXPECT_EQ(tiles[0].bound_by, bound_of(Stage::kTriangleTests));
    EXPECT_NEAR(tiles[0].bound_cycles, tests / 2, 1);
  }
  EXPECT_FALSE(attribute_tiles(gpu, work, schedule, {}, TileBounds::kNone)[0].bound_by);
}

}  // namespace
}  // namespace tessera::timing::attribution_test
