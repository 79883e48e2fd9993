#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <set>

#include "base/error.h"
#include "binner/binner.h"
#include "gpu/configuration.h"
#include "tests/binner/posed_object.h"
#include "tests/support/captures.h"

namespace tessera::binner {
namespace {

using frontend::ScreenBounds;
using test::Random;

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

RC_GTEST_PROP(QueueEntry, UnpacksToItselfWithDepthsRoundedOutwards, ()) {
  QueueEntry e;
  e.base_patch = *rc::gen::arbitrary<std::uint32_t>();
  const auto cell = [] { return *rc::gen::inRange<std::uint8_t>(0, 125); };
  e.range = {cell(), cell(), cell(), cell()};
  e.near_depth = static_cast<float>(*rc::gen::inRange(0, 1 << 30)) * 1e-4f;
  e.far_depth = e.near_depth + static_cast<float>(*rc::gen::inRange(0, 1 << 20)) * 1e-3f;
  e.t0 = *rc::gen::arbitrary<std::uint8_t>();
  e.t1 = *rc::gen::arbitrary<std::uint8_t>();
  e.flags = *rc::gen::inRange<std::uint8_t>(0, 64);
  const QueueEntry back = unpack(pack(e));
  RC_ASSERT(back.base_patch == e.base_patch);
  RC_ASSERT(back.range == e.range);
  RC_ASSERT(back.t0 == e.t0 && back.t1 == e.t1 && back.flags == e.flags);
  RC_ASSERT(back.near_depth <= e.near_depth && back.near_depth >= e.near_depth * 0.99f);
  RC_ASSERT(back.far_depth >= e.far_depth && back.far_depth <= e.far_depth * 1.01f + 1e-30f);
}

TEST(QueueEntry, ExtremeDepthsStayOrdered) {
  QueueEntry e;
  e.near_depth = -0.0f;
  e.far_depth = std::numeric_limits<float>::max();
  const QueueEntry back = unpack(pack(e));
  EXPECT_EQ(back.near_depth, 0.0f);
  EXPECT_TRUE(std::isinf(back.far_depth));
}

TEST(QueueEntry, ARangeThatDoesNotFitIsABrokenInvariantNotAWrap) {
  QueueEntry e;
  e.range.i1 = 128;
  EXPECT_DEATH(pack(e), "7 bits");
}

// ---- Parameter buffer -------------------------------------------------------------------------------------------

gpu::GpuConfiguration small_gpu() {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = 2048;
  gpu.parameter_buffer.chunk_bytes = 128;  // 7 entries
  gpu.memory.burst_bytes = 64;
  gpu.binner.combining_bursts = 4;
  return gpu;
}

QueueEntry entry_number(std::uint32_t n) {
  QueueEntry e;
  e.base_patch = n;
  return e;
}

// Patches of a queue's entries, and the payload bytes read with them.
std::vector<std::uint32_t> numbers(const ParameterBuffer& buffer, QueueIndex queue, memory::Ledger& ledger,
                                   std::uint64_t& bytes_read) {
  std::vector<QueueEntry> entries;
  buffer.read_queue(queue, entries, ledger, bytes_read);
  std::vector<std::uint32_t> out;
  for (const QueueEntry& e : entries) out.push_back(e.base_patch);
  return out;
}

TEST(ParameterBuffer, PB1FullItRefusesAndWhatWasAcceptedIsStillThere) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 8);
  Random random(1);
  std::map<TileIndex, std::vector<std::uint32_t>> accepted;
  int refused = 0;
  for (std::uint32_t n = 0; n < 400; ++n) {
    const auto tile = static_cast<TileIndex>(random.integer(0, 7));
    const std::uint64_t before = buffer.bytes_in_use();
    if (buffer.append(tile, entry_number(n))) {
      accepted[tile].push_back(n);
    } else {
      ++refused;
      EXPECT_EQ(buffer.bytes_in_use(), before);
    }
    ASSERT_LE(buffer.bytes_in_use(), 2048u);
  }
  EXPECT_GT(refused, 0);
  buffer.finish();
  for (TileIndex tile = 0; tile < 8; ++tile) {
    memory::Ledger ledger;
    std::uint64_t read = 0;
    EXPECT_EQ(numbers(buffer, tile, ledger, read), accepted[tile]);
  }
  EXPECT_EQ(buffer.counters().queue_bytes_peak, buffer.bytes_in_use());
}

TEST(ParameterBuffer, PB2EntriesComeBackInTheOrderOfAppendingAcrossChunks) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 1 << 20;
  ParameterBuffer buffer(gpu.binner_spec(), 5);
  std::map<TileIndex, std::vector<std::uint32_t>> expected;
  for (std::uint32_t n = 0; n < 3000; ++n) {
    const TileIndex tile = (n * n + n / 3) % 5;
    ASSERT_TRUE(buffer.append(tile, entry_number(n)));
    expected[tile].push_back(n);
  }
  buffer.finish();
  for (TileIndex tile = 0; tile < 5; ++tile) {
    memory::Ledger ledger;
    std::uint64_t read = 0;
    EXPECT_EQ(numbers(buffer, tile, ledger, read), expected[tile]);
  }
  EXPECT_EQ(buffer.counters().entries, 3000u);
}

TEST(ParameterBuffer, SpillsIntoTheOverflowAreaWhenThePolicySaysSo) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  ParameterBuffer buffer(gpu.binner_spec(), 4);
  for (std::uint32_t n = 0; n < 1000; ++n) ASSERT_TRUE(buffer.append(n % 4, entry_number(n)));
  EXPECT_GT(buffer.counters().spilled_chunks, 0u);
  // 1000 entries over 4 tiles in chunks of 7: 36 chunks each; 2048 bytes hold the heads (64 bytes) and 15 chunks.
  EXPECT_EQ(buffer.counters().spilled_chunks, 4u * 36u - 15u);
}

TEST(ParameterBuffer, PB3TheBurstsOfOneTileAreThoseOfItsBytes) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 1 << 16;
  ParameterBuffer buffer(gpu.binner_spec(), 1);
  for (std::uint32_t n = 0; n < 7; ++n) ASSERT_TRUE(buffer.append(0, entry_number(n)));
  buffer.finish();
  // Head: one burst. Chunk: 8 + 7 * 16 = 120 bytes = two bursts. Nothing was evicted in between.
  const auto& written = buffer.ledger().traffic(memory::Unit::kBinner, memory::Purpose::kTileQueue);
  EXPECT_EQ(written.written_bytes, 3 * 64u);
  EXPECT_EQ(written.read_bytes, 0u);
  memory::Ledger ledger;
  std::uint64_t payload = 0;
  numbers(buffer, 0, ledger, payload);
  EXPECT_EQ(ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kTileQueue).read_bytes, 3 * 64u);
  EXPECT_EQ(payload, 16u + 8u + 7u * 16u);
  EXPECT_EQ(buffer.counters().queue_bytes_written, 16u + 7u * 16u);
}

TEST(ParameterBuffer, AnEmptyTileCostsItsHeadOnly) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 3);
  buffer.finish();
  memory::Ledger ledger;
  std::uint64_t payload = 0;
  EXPECT_TRUE(numbers(buffer, 2, ledger, payload).empty());
  EXPECT_EQ(payload, 16u);
}

TEST(ParameterBuffer, ABufferOfExactlyTheNeededSizeSuffices) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.bytes = 64 + 2 * 128;  // heads of 4 tiles, two chunks
  ParameterBuffer buffer(gpu.binner_spec(), 4);
  for (std::uint32_t n = 0; n < 14; ++n) EXPECT_TRUE(buffer.append(n < 7 ? 0 : 1, entry_number(n)));
  EXPECT_FALSE(buffer.append(2, entry_number(99)));
}

TEST(ParameterBuffer, OneThatCannotHoldAChunkIsRefusedWithTheNumbers) {
  gpu::GpuConfiguration gpu = small_gpu();
  gpu.parameter_buffer.chunk_bytes = 4096;
  EXPECT_THROW(ParameterBuffer(gpu.binner_spec(), 4), UsageError);
}

TEST(ParameterBuffer, ResetEmptiesEveryQueue) {
  ParameterBuffer buffer(small_gpu().binner_spec(), 2);
  ASSERT_TRUE(buffer.append(1, entry_number(5)));
  buffer.finish();
  buffer.reset();
  memory::Ledger ledger;
  std::uint64_t payload = 0;
  EXPECT_TRUE(numbers(buffer, 1, ledger, payload).empty());
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
  for (std::uint32_t n = 0; n < 60; ++n) {
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
        for (const QueueEntry& e : binner.read_tile(t, ledger, payload)) queues[t].push_back(e.range.i0);
      }
      binner.reset();
    }
    overlaps = binner.buffer().counters().tile_overlaps;
    return queues;
  };
  std::uint64_t one_pass = 0, many_passes = 0, overlaps = 0, overlaps_again = 0;
  const auto expected = collect(1 << 20, one_pass, overlaps);
  EXPECT_EQ(collect(256 + 3 * 128, many_passes, overlaps_again), expected);
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
}  // namespace tessera::binner
