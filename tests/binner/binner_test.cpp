#include <rapidcheck/gtest.h>

#include "base/error.h"
#include "binner/binner.h"
#include "gpu/configuration.h"
#include "tests/binner/posed_object.h"
#include "tests/support/tests.h"

namespace tessera::binner::binner_test {
namespace {

using frontend::ScreenBounds;

// ---- Tile grid --------------------------------------------------------------------------------------------------

TEST(TileGrid, TilesPartTheFrameWithoutGapOrOverlap) {
  for (const auto& [width, height] : {std::pair{1, 1}, {31, 33}, {64, 64}, {100, 7}}) {
    const TileGrid grid(width, height, 32, 16);
    std::multiset<std::pair<int, int>> seen;
    for (TileIndex t = 0; t < grid.tile_count(); ++t) {
      const IntRect r = grid.pixels(t);
      EXPECT_FALSE(r.empty());
      for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) seen.emplace(x, y);
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(width * height));
    EXPECT_EQ(std::set(seen.begin(), seen.end()).size(), seen.size());
  }
}

TEST(TileGrid, ARegionKeepsOnlyItsTilesAndItsPixels) {
  const TileGrid grid(128, 128, 32, 32, {40, 40, 70, 64});
  EXPECT_EQ(grid.tile_count(), 2u);
  EXPECT_EQ(grid.pixels(0), (IntRect{40, 40, 64, 64}));
  EXPECT_EQ(grid.pixels(1), (IntRect{64, 40, 70, 64}));
}

ScreenBounds bounds_at(float x0, float y0, float x1, float y1) { return {x0, y0, x1, y1, 0, 1, 2, false}; }

TEST(TileGrid, BoundsThatEndOnATilesEdgeBelongToBothTiles) {
  const TileGrid grid(128, 128, 32, 32);
  EXPECT_EQ(grid.covered(bounds_at(32, 0, 40, 10)), (IntRect{0, 0, 2, 1}));
  EXPECT_EQ(grid.covered(bounds_at(10, 10, 32, 32)), (IntRect{0, 0, 2, 2}));
  EXPECT_EQ(grid.covered(bounds_at(33, 0, 40, 10)), (IntRect{1, 0, 2, 1}));
}

TEST(TileGrid, BoundsOutsideOnAnySideCoverNothingAndHugeOnesEverything) {
  const TileGrid grid(100, 100, 32, 32);
  EXPECT_TRUE(grid.covered(bounds_at(-50, 10, -1, 20)).empty());
  EXPECT_TRUE(grid.covered(bounds_at(200, 10, 300, 20)).empty());
  EXPECT_TRUE(grid.covered(bounds_at(10, -50, 20, -1)).empty());
  EXPECT_TRUE(grid.covered(bounds_at(10, 200, 20, 300)).empty());
  EXPECT_EQ(grid.covered(bounds_at(-3e38f, -3e38f, 3e38f, 3e38f)), (IntRect{0, 0, 4, 4}));
}

TEST(TileGrid, CoversExactlyTheTilesWhosePixelsTheBoundTouches) {
  Random random(1);
  for (int trial = 0; trial < 3000; ++trial) {
    const TileGrid grid(
        150, 90, 16, 24,
        {random.integer(0, 60), random.integer(0, 40), random.integer(61, 150), random.integer(41, 90)});
    const float x0 = static_cast<float>(random.integer(-40, 180)) * 0.5f,
                y0 = static_cast<float>(random.integer(-40, 120)) * 0.5f;
    const ScreenBounds b = bounds_at(x0, y0, x0 + static_cast<float>(random.integer(0, 80)),
                                     y0 + static_cast<float>(random.integer(0, 80)));
    const IntRect covered = grid.covered(b);
    for (TileIndex t = 0; t < grid.tile_count(); ++t) {
      const int column = static_cast<int>(t) % grid.columns(), row = static_cast<int>(t) / grid.columns();
      // Whole tiles, not cut to the region: a bound may reach into one from outside the region.
      const IntRect r = grid.pixels(t);
      const bool touches = b.x1 >= static_cast<float>(r.x0) && b.x0 <= static_cast<float>(r.x1) &&
                           b.y1 >= static_cast<float>(r.y0) && b.y0 <= static_cast<float>(r.y1);
      if (touches) {
        EXPECT_TRUE(covered.contains(column, row));
      }
    }
  }
}

TEST(TileGrid, MoreThan65535TilesAreNumberedRight) {
  const TileGrid grid(16384, 16384, 32, 32);
  EXPECT_EQ(grid.tile_count(), 512u * 512u);
  EXPECT_EQ(grid.pixels(grid.tile_count() - 1), (IntRect{16352, 16352, 16384, 16384}));
  EXPECT_EQ(grid.index(511, 511), grid.tile_count() - 1);
}

// ---- Queue entry ------------------------------------------------------------------------------------------------

RC_GTEST_PROP(ListEntry, ARecordUnpacksToItself, ()) {
  ListEntry e;
  e.base_patch = *rc::gen::arbitrary<std::uint32_t>() >> *rc::gen::inRange(0, 20);
  const auto cell = [] { return *rc::gen::inRange<std::uint8_t>(0, 128); };
  e.whole = *rc::gen::arbitrary<bool>();
  e.range = {cell(), cell(), cell(), cell()};
  e.near_depth = static_cast<float>(*rc::gen::inRange(0, 1 << 30)) * 1e-4f;
  e.segment = *rc::gen::arbitrary<bool>() ? *rc::gen::inRange<std::uint16_t>(1, 4096) : std::uint16_t{0};
  e.flags = *rc::gen::inRange<std::uint8_t>(0, 32);
  const auto bits = [](int count) { return *rc::gen::inRange<std::uint8_t>(0, static_cast<std::uint8_t>(1 << count)); };
  e.blocks = {bits(4), bits(4), bits(3), bits(3), bits(1) != 0};
  e.lists = static_cast<std::uint16_t>(*rc::gen::inRange(1, 1 << 10) >> *rc::gen::inRange(0, 10));
  PackedRecord record = pack_record(e);
  const bool is_short = record.size == kSlotBytes;
  RC_ASSERT(is_short == (e.whole && e.base_patch < 1u << 24 && e.lists < 16 && e.segment == 0 && !e.blocks.wide));
  const ListEntry back = unpack_record(record.used());
  RC_ASSERT(back.base_patch == e.base_patch);
  RC_ASSERT(back.whole == is_short);
  RC_ASSERT(back.range == (is_short ? scene::CellRange{} : e.range));
  RC_ASSERT(back.segment == e.segment && back.flags == e.flags && back.lists == e.lists);
  RC_ASSERT(back.blocks == e.blocks);
  // Nearer, by less than one part of 256: nothing is culled that a float would keep.
  const bool exact = !is_short && e.segment < 31;
  RC_ASSERT(back.near_depth <= e.near_depth && back.near_depth >= e.near_depth * (exact ? 1.0f : 255.0f / 256));
  const auto fewer = static_cast<std::uint16_t>(e.lists / 2);
  lower_lists(std::span(record.bytes).first(record.size), fewer);
  ListEntry expected = back;
  expected.lists = fewer;
  RC_ASSERT(unpack_record(record.used()) == expected);
}

TEST(ListEntry, ExtremeDepthsStayOrdered) {
  const auto stored = [](float depth) {
    ListEntry e;
    e.near_depth = depth;
    return unpack_record(pack_record(e).used()).near_depth;
  };
  EXPECT_EQ(stored(-1.0f), 0.0f);
  EXPECT_FALSE(std::signbit(stored(-0.0f)));
  EXPECT_EQ(stored(std::numeric_limits<float>::quiet_NaN()), 0.0f);
  EXPECT_EQ(stored(std::numeric_limits<float>::denorm_min()), std::numeric_limits<float>::denorm_min());
  EXPECT_EQ(stored(std::numeric_limits<float>::max()), std::numeric_limits<float>::max());
}

TEST(ListEntry, ARangeThatDoesNotFitIsABrokenInvariantNotAWrap) {
  ListEntry e;
  e.range.i1 = 128;
  EXPECT_DEATH(pack_record(e), "7 bits");
  e = {};
  e.flags = 32;
  EXPECT_DEATH(pack_record(e), "5 bits");
  e = {};
  e.segment = 4096;
  EXPECT_DEATH(pack_record(e), "a segment of motion 12");
  e = {};
  e.blocks.row = 16;
  EXPECT_DEATH(pack_record(e), "4 and 3 bits");
}

// ---- Parameter buffer -------------------------------------------------------------------------------------------

// 8 lists: 64 bytes of bits, 64 of cursors, 256 of first chunks; further chunks of 128.
constexpr std::uint64_t kFixed = 64 + 64 + 256;
gpu::GpuConfiguration small_gpu() {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = 2048;
  gpu.parameter_buffer.chunk_bytes = 128;
  gpu.memory.burst_bytes = 64;
  gpu.binner.combining_bursts = 4;
  return gpu;
}

// Puts a sub-patch into one list.
bool put(ParameterBuffer& buffer, QueueIndex list, std::uint32_t patch, TimeInterval times = {}) {
  ListEntry e;
  e.base_patch = patch;
  const std::vector<ListLevels::Placement> one = {{list, times}};
  std::uint32_t next = 0;
  return buffer.append(e, one, next);
}

// Patches of a list's entries, and the bytes read with them.
std::vector<std::uint32_t> numbers(const ParameterBuffer& buffer, QueueIndex list, memory::Ledger& ledger,
                                   std::uint64_t& bytes_read) {
  std::vector<ListEntry> entries;
  buffer.read_queue(list, entries, ledger, bytes_read);
  std::vector<std::uint32_t> out;
  for (const ListEntry& e : entries) out.push_back(e.base_patch);
  return out;
}
std::vector<std::uint32_t> numbers(const ParameterBuffer& buffer, QueueIndex list) {
  memory::Ledger ledger;
  std::uint64_t ignored = 0;
  return numbers(buffer, list, ledger, ignored);
}

TEST(ParameterBuffer, PB1FullItRefusesAndKeepsAcceptedEntries) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 8);
  Random random(1);
  std::map<TileIndex, std::vector<std::uint32_t>> accepted;
  int refused = 0;
  for (std::uint32_t n = 0; n < 400; ++n) {
    const auto tile = static_cast<TileIndex>(random.integer(0, 7));
    const std::uint64_t before = buffer.bytes_in_use();
    if (put(buffer, tile, n)) {
      accepted[tile].push_back(n);
    } else {
      ++refused;
      EXPECT_EQ(buffer.bytes_in_use(), before);
    }
    ASSERT_LE(buffer.bytes_in_use(), 2048u);
  }
  EXPECT_GT(refused, 0);
  buffer.finish();
  for (TileIndex tile = 0; tile < 8; ++tile) EXPECT_EQ(numbers(buffer, tile), accepted[tile]);
  EXPECT_EQ(buffer.counters().queue_bytes_peak, buffer.bytes_in_use());
}

TEST(ParameterBuffer, PB2EntriesComeBackInTheOrderOfAppendingAcrossChunks) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 1 << 20;
  ParameterBuffer buffer(gpu.binner_spec(), 5);
  std::map<TileIndex, std::vector<std::uint32_t>> expected;
  for (std::uint32_t n = 0; n < 3000; ++n) {
    const TileIndex tile = (n * n + n / 3) % 5;
    ASSERT_TRUE(put(buffer, tile, n, {static_cast<int>(n % 7), 255 - static_cast<int>(n % 3)}));
    expected[tile].push_back(n);
  }
  buffer.finish();
  for (TileIndex tile = 0; tile < 5; ++tile) EXPECT_EQ(numbers(buffer, tile), expected[tile]);
  EXPECT_EQ(buffer.counters().entries, 3000u);
  EXPECT_EQ(buffer.counters().table_records, 3000u);
}

TEST(ParameterBuffer, SpillsIntoTheOverflowAreaWhenThePolicySaysSo) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  ParameterBuffer buffer(gpu.binner_spec(), 8);
  for (std::uint32_t n = 0; n < 1000; ++n) ASSERT_TRUE(put(buffer, n % 4, n, {1, 2}));
  // 250 entries of 3 bytes in each of four lists: 28 bytes in the first chunk, then 6 chunks of 124. 2048 bytes hold
  // the fixed part of every list; the rest goes to chunks and bursts of records as they are asked for.
  EXPECT_EQ(buffer.bytes_in_use(), kFixed + 4 * 6 * 128 + 1000 * 16);
  // All that was handed out of the 2048 bytes is in use: records, entries of 3 bytes, links.
  EXPECT_EQ(buffer.counters().spilled_bytes, 16000 + 3000 + 24 * 4 - 4 * (28 + 4) - (2048 - kFixed));
  for (TileIndex tile = 0; tile < 4; ++tile) EXPECT_EQ(numbers(buffer, tile).size(), 250u);
}

TEST(ParameterBuffer, PB3TheBurstsOfOneTileFollowFromItsBytes) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 1 << 16;
  gpu.binner.combining_bursts = 16;
  ParameterBuffer buffer(gpu.binner_spec(), 1);
  for (std::uint32_t n = 0; n < 30; ++n) ASSERT_TRUE(put(buffer, 0, n));
  buffer.finish();
  // A burst each of bits, cursors, the first chunk (28 of 30 bytes), a further one; 480 bytes of records in 8 bursts.
  // Nothing was evicted in between. The tile scheduler reads the bits.
  const auto& written = buffer.ledger().traffic(memory::Unit::kBinner, memory::Purpose::kTileQueue);
  EXPECT_EQ(written.written_bytes, (4 + 8) * 64u);
  EXPECT_EQ(written.read_bytes, 64u);
  memory::Ledger ledger;
  std::uint64_t payload = 0;
  numbers(buffer, 0, ledger, payload);
  EXPECT_EQ(ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kTileQueue).read_bytes, 2 * 64u);
  EXPECT_EQ(payload, 28u + 4 + 2 + 1);
  EXPECT_EQ(buffer.table_bytes_written(), 480u);
  EXPECT_EQ(buffer.counters().queue_bytes_written, 480u + 30 + 4 + 1 + 8 + 1);
}

TEST(ParameterBuffer, AnEmptyListCostsItsBitOnly) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 3);
  buffer.finish();
  memory::Ledger ledger;
  std::uint64_t payload = 0;
  EXPECT_TRUE(numbers(buffer, 2, ledger, payload).empty());
  EXPECT_EQ(payload, 0u);
  EXPECT_EQ(ledger.total().read_bytes, 0u);
  EXPECT_EQ(buffer.counters().queue_bytes_written, 1u);
  EXPECT_EQ(buffer.ledger().total().written_bytes, 64u);
}

TEST(ParameterBuffer, ABufferOfExactlyTheNeededSizeSuffices) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = kFixed + 128 + 8 * 64;  // one further chunk, 32 records
  for (const std::int64_t less : {0, 64}) {
    gpu::GpuConfiguration smaller = gpu;
    smaller.parameter_buffer.bytes -= less;
    ParameterBuffer buffer(smaller.binner_spec(), 8);
    for (std::uint32_t n = 0; n < 28; ++n) EXPECT_TRUE(put(buffer, 0, n));
    EXPECT_EQ(put(buffer, 0, 28), less == 0);  // takes the chunk, and a burst for four records
    for (std::uint32_t n = 29; n < 32 && less == 0; ++n) EXPECT_TRUE(put(buffer, 1, n));
    EXPECT_EQ(put(buffer, 1, 99), less != 0) << "a burst of records, but no chunk";
  }
}

TEST(ParameterBuffer, OneThatCannotHoldAChunkIsRefusedWithTheNumbers) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.chunk_bytes = 4096;
  EXPECT_THROW(ParameterBuffer(gpu.binner_spec(), 4), UsageError);
}

TEST(ParameterBuffer, ResetEmptiesEveryListAndTheTable) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 2);
  ASSERT_TRUE(put(buffer, 1, 5));
  buffer.finish();
  buffer.reset();
  EXPECT_TRUE(numbers(buffer, 1).empty());
  EXPECT_EQ(buffer.end_of_records(), 0u);
  ASSERT_TRUE(put(buffer, 1, 7));
  EXPECT_EQ(numbers(buffer, 1), std::vector<std::uint32_t>{7});
}

// ---- Write combiner ---------------------------------------------------------------------------------------------

TEST(WriteCombiner, NeighbouringWritesLeaveAsOneBurst) {
  memory::Ledger ledger;
  WriteCombiner combiner(2, 64, ledger);
  for (std::uint64_t address = 0; address < 64; address += 8) combiner.write(address, 8);
  EXPECT_EQ(ledger.total().written_bytes, 0u);
  combiner.flush();
  EXPECT_EQ(ledger.total().written_bytes, 64u);
  combiner.flush();
  EXPECT_EQ(ledger.total().written_bytes, 64u);
}

TEST(WriteCombiner, EvictsTheLeastRecentlyUsedLine) {
  memory::Ledger ledger;
  WriteCombiner combiner(2, 64, ledger);
  combiner.write(0, 8);
  combiner.write(64, 8);
  combiner.write(8, 8);    // line 0 is young again
  combiner.write(128, 8);  // line 1 leaves
  EXPECT_EQ(ledger.total().written_bytes, 64u);
  combiner.write(16, 8);  // line 0 is still here
  EXPECT_EQ(ledger.total().written_bytes, 64u);
  combiner.write(64, 8);  // line 2 leaves
  EXPECT_EQ(ledger.total().written_bytes, 128u);
}

TEST(WriteCombiner, ReadsFetchLinesThatAreNotThereAndWriteBackNothing) {
  memory::Ledger ledger;
  WriteCombiner combiner(1, 32, ledger);
  combiner.read(0, 4);
  combiner.read(8, 4);
  combiner.read(40, 4);
  combiner.flush();
  EXPECT_EQ(ledger.total().read_bytes, 64u);
  EXPECT_EQ(ledger.total().written_bytes, 0u);
}

// ---- Binner -----------------------------------------------------------------------------------------------------

TEST(Binner, APassThatStopsWhenFullGoesOnWhereItStopped) {
  const PosedObject scene;
  std::vector<frontend::BoundedSubPatch> sub_patches;
  Random random(2);
  for (std::uint32_t n = 0; n < 120; ++n) {
    const float x = random.uniform(-20, 140), y = random.uniform(-20, 140);
    sub_patches.push_back({n % 6,
                           {static_cast<std::uint8_t>(n), 0, 1, 1},
                           bounds_at(x, y, x + random.uniform(0, 90), y + random.uniform(0, 90)),
                           {}});
  }
  // Every (sub-patch, tile) pair arrives once, in order, however small the buffer.
  const auto collect = [&](std::int64_t bytes, std::uint64_t& passes, std::uint64_t& overlaps) {
    gpu::GpuConfiguration gpu = small_gpu();
    gpu.parameter_buffer.bytes = bytes;
    Binner binner(gpu.binner_spec(), TileGrid(128, 128, 32, 32));
    std::map<TileIndex, std::vector<int>> queues;
    Binner::Cursor cursor;
    bool done = false;
    while (!done) {
      done = binner.run(*scene.frame, sub_patches, cursor);
      ++passes;
      for (TileIndex t = 0; t < binner.grid().tile_count(); ++t) {
        memory::Ledger ledger;
        std::uint64_t payload = 0;
        for (const ListEntry& e : binner.read_tile(*scene.frame, t, ledger, payload)) queues[t].push_back(e.range.i0);
      }
      binner.reset();
    }
    overlaps = binner.buffer().counters().tile_overlaps;
    return queues;
  };
  std::uint64_t one_pass = 0, many_passes = 0, overlaps = 0, overlaps_again = 0;
  const auto expected = collect(1 << 20, one_pass, overlaps);
  EXPECT_EQ(collect(64 + 128 + 512 + 128 + 64, many_passes, overlaps_again), expected);
  EXPECT_EQ(one_pass, 1u);
  EXPECT_GT(many_passes, 5u);
  EXPECT_EQ(overlaps, overlaps_again);
  std::uint64_t pairs = 0;
  for (const auto& [tile, queue] : expected) pairs += queue.size();
  EXPECT_EQ(pairs, overlaps);
}

TEST(Binner, NoSubPatchesGiveEmptyQueues) {
  const PosedObject scene;
  Binner binner(small_gpu().binner_spec(), TileGrid(128, 128, 32, 32));
  Binner::Cursor cursor;
  EXPECT_TRUE(binner.run(*scene.frame, {}, cursor));
  EXPECT_EQ(binner.buffer().counters().entries, 0u);
}

TEST(Binner, ASubPatchOverTheWholeFrameIsInEveryTile) {
  const PosedObject scene;
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 1 << 16;
  Binner binner(gpu.binner_spec(), TileGrid(128, 128, 16, 16));
  const std::vector<frontend::BoundedSubPatch> one = {{0, {0, 0, 1, 1}, bounds_at(-1e6f, -1e6f, 1e6f, 1e6f), {}}};
  Binner::Cursor cursor;
  ASSERT_TRUE(binner.run(*scene.frame, one, cursor));
  EXPECT_EQ(binner.buffer().counters().entries, 64u);
}

}  // namespace
}  // namespace tessera::binner::binner_test
