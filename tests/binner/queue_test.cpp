// Queues of groups of tiles, the traffic of all queues burst by burst, and the binner's hard cases.
#include <list>

#include "base/error.h"
#include "base/round_up.h"
#include "binner/binner.h"
#include "gpu/configuration.h"
#include "tests/binner/posed_object.h"
#include "tests/support/tests.h"

namespace tessera::binner::queue_test {
namespace {

using frontend::BoundedSubPatch;

// ---- Placement in levels of queues ------------------------------------------------------------------------------

TileCoverage random_coverage(Random& random, const TileGrid& grid) {
  TileCoverage c;
  c.tiles.x0 = random.integer(0, grid.columns() - 1);
  c.tiles.y0 = random.integer(0, grid.rows() - 1);
  c.tiles.x1 = random.integer(c.tiles.x0 + 1, grid.columns());
  c.tiles.y1 = random.integer(c.tiles.y0 + 1, grid.rows());
  const int holes = random.integer(0, 4);  // of 8 tiles
  for (int k = 0; k < c.tiles.width() * c.tiles.height(); ++k) {
    const int first = random.integer(0, 255);
    c.times.push_back(random.integer(0, 7) < holes ? kNoTime : TimeInterval{first, random.integer(first, 255)});
    c.covered += c.times.back().empty() ? 0 : 1;
  }
  return c;
}

using Placements = std::vector<ListLevels::Placement>;

// Covered tiles that do not read exactly one entry that holds their times; others may read one in vain, not two.
int misplaced(const ListLevels& hierarchy, const TileGrid& grid, const TileCoverage& coverage,
              const Placements& placements) {
  std::map<QueueIndex, TimeInterval> queues;
  for (const auto& p : placements) queues[p.queue] = p.times;
  int wrong = queues.size() == placements.size() ? 0 : 1;
  for (int row = 0; row < grid.rows(); ++row)
    for (int column = 0; column < grid.columns(); ++column) {
      const TimeInterval wanted = coverage.tiles.contains(column, row) ? coverage.at(column, row) : kNoTime;
      int entries = 0;
      bool held = true;
      hierarchy.for_each_queue_of(grid.index(column, row), [&](QueueIndex queue) {
        const auto found = queues.find(queue);
        if (found == queues.end()) return;
        ++entries;
        held = found->second.hull(wanted) == found->second;
      });
      if (wanted.empty() ? entries > 1 : entries != 1 || !held) ++wrong;
    }
  return wrong;
}

// Bytes that entries move: written once, read by every tile of their queue, which then fetches the patch.
std::uint64_t bytes_moved(const ListLevels& hierarchy, const TileGrid& grid, const Placements& placements,
                          std::uint64_t patch_bytes) {
  std::map<QueueIndex, std::uint64_t> readers;
  for (TileIndex tile = 0; tile < grid.tile_count(); ++tile)
    hierarchy.for_each_queue_of(tile, [&](QueueIndex queue) { ++readers[queue]; });
  std::uint64_t bytes = 0;
  for (const auto& p : placements)
    bytes += ListLevels::kWrittenBytes + readers[p.queue] * (ListLevels::kReadBytes + patch_bytes);
  return bytes;
}

// All covered tiles' entries at one level.
Placements uniform(const ListLevels& hierarchy, const TileCoverage& c, int level) {
  std::map<QueueIndex, TimeInterval> queues;
  for (int row = c.tiles.y0; row < c.tiles.y1; ++row)
    for (int column = c.tiles.x0; column < c.tiles.x1; ++column) {
      if (c.at(column, row).empty()) continue;
      const QueueIndex queue = hierarchy.queue(level, column >> level, row >> level);
      const auto [slot, fresh] = queues.emplace(queue, kNoTime);
      slot->second = slot->second.hull(c.at(column, row));
    }
  Placements out;
  for (const auto& [queue, times] : queues) out.push_back({queue, times});
  return out;
}

TEST(ListLevels, EveryCoveredTileReadsOneEntryWithItsTimesAndNoLevelAloneMovesFewerBytes) {
  Random random(1);
  for (int trial = 0; trial < 400; ++trial) {
    const int levels = random.integer(1, 5);
    const TileGrid grid(random.integer(1, 700), random.integer(1, 500), 32, 16);
    const ListLevels hierarchy(grid, levels);
    const TileCoverage coverage = random_coverage(random, grid);
    const std::uint64_t patch_bytes = random.coin() ? 0 : 224;
    Placements placements;
    hierarchy.place(coverage, patch_bytes, placements);
    ASSERT_EQ(misplaced(hierarchy, grid, coverage, placements), 0);
    const std::uint64_t moved = bytes_moved(hierarchy, grid, placements, patch_bytes);
    for (int level = 0; level < levels; ++level)
      ASSERT_LE(moved, bytes_moved(hierarchy, grid, uniform(hierarchy, coverage, level), patch_bytes))
          << level << " of " << levels;
    if (levels == 1) {
      ASSERT_EQ(placements.size(), coverage.covered);
    }
  }
}

TEST(QueueHierarchyTwin, AnEntryForgottenDoubledShiftedOrCutShortIsCaught) {
  Random random(2);
  const TileGrid grid(640, 360, 32, 32);
  const ListLevels hierarchy(grid, 3);
  TileCoverage coverage{
      {0, 0, grid.columns(), grid.rows()}, std::vector<TimeInterval>(grid.tile_count()), grid.tile_count(), 0, 0};
  Placements good;
  hierarchy.place(coverage, 0, good);
  ASSERT_EQ(misplaced(hierarchy, grid, coverage, good), 0);
  Placements forgotten(good.begin() + 1, good.end()), doubled = good, shifted = good, cut = good;
  doubled.push_back({0, {}});
  shifted[0].queue += 1;
  cut[0].times.last = 254;
  for (const Placements& bad : {forgotten, doubled, shifted, cut})
    EXPECT_GT(misplaced(hierarchy, grid, coverage, bad), 0);
}

TEST(ListLevels, QueuesAreNumberedLevelByLevelAndQueuesOfTilesAsTheTiles) {
  const TileGrid grid(160, 96, 32, 32);  // 5 x 3 tiles, 3 x 2 groups of four, 2 x 1 of sixteen
  const ListLevels hierarchy(grid, 3);
  EXPECT_EQ(hierarchy.queue_count(), 15u + 6u + 2u);
  std::vector<QueueIndex> queues;
  hierarchy.for_each_queue_of(grid.index(4, 2), [&](QueueIndex q) { queues.push_back(q); });
  EXPECT_EQ(queues, (std::vector<QueueIndex>{14, 15 + 5, 15 + 6 + 1}));
}

TEST(ListLevels, OneTileHasAQueueOfItsOwnAtEveryLevelAndUsesTheFinest) {
  const TileGrid grid(1, 1, 32, 32);
  const ListLevels hierarchy(grid, 5);
  EXPECT_EQ(hierarchy.queue_count(), 5u);
  Placements placements;
  hierarchy.place({{0, 0, 1, 1}, {TimeInterval{3, 9}}, 1, 0, 0}, 0, placements);
  ASSERT_EQ(placements.size(), 1u);
  EXPECT_EQ(placements[0].queue, 0u);
  EXPECT_EQ(placements[0].times, (TimeInterval{3, 9}));
}

// ---- Traffic, burst by burst ------------------------------------------------------------------------------------

// Memory accesses of a sequence of sub-patches that each go to one list at all times, from the layout alone: bits of
// lists, cursors, first chunks, each in whole bursts, chunks in the order in which they are needed; and an obvious cache
// of the last lines in front.
struct TrafficOracle {
  std::uint64_t burst, lines, first_chunk_bytes, chunk_bytes, table;
  std::uint64_t lists, chunks = 0, table_end = 0, record_bytes = 0;
  std::uint64_t read = 0, written = 0;
  struct List {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> chunks;  // address, bytes used
    std::uint64_t bytes = 0, before = 0;
  };
  std::map<QueueIndex, List> queues;
  std::list<std::pair<std::uint64_t, bool>> cache;  // most recent first; line, changed

  void access(std::uint64_t address, std::uint64_t bytes, bool write) {
    for (std::uint64_t line = address / burst; line * burst < address + bytes; ++line) {
      auto found = std::find_if(cache.begin(), cache.end(), [&](const auto& c) { return c.first == line; });
      bool changed = write;
      if (found != cache.end()) {
        changed = changed || found->second;
        cache.erase(found);
      } else {
        if (cache.size() == lines) flush_last();
        if (!write) read += burst;
      }
      cache.emplace_front(line, changed);
    }
  }
  void flush_last() {
    if (cache.back().second) written += burst;
    cache.pop_back();
  }
  std::uint64_t cursors_at() const { return round_up((lists + 7) / 8, burst); }
  std::uint64_t first_chunks_at() const { return cursors_at() + round_up(8 * lists, burst); }
  std::uint64_t end() const { return first_chunks_at() + round_up(first_chunk_bytes * lists, burst); }
  std::uint64_t room(const List& list) const {
    return (list.chunks.size() == 1 ? first_chunk_bytes : chunk_bytes) - 4 - list.chunks.back().second;
  }
  void begin() { access(0, (lists + 7) / 8, true); }
  void append(QueueIndex number, std::uint64_t bytes_of_record) {
    const std::uint64_t record = round_up(table_end, bytes_of_record);
    access(table + record, bytes_of_record, true);
    table_end = record + bytes_of_record;
    record_bytes += bytes_of_record;
    List& list = queues[number];
    access(number / 8, 1, false);
    const std::uint64_t cursor = cursors_at() + 8 * number;
    if (list.chunks.empty()) {
      access(number / 8, 1, true);
      list.chunks.push_back({first_chunks_at() + first_chunk_bytes * number, 0});
    } else {
      access(cursor, 8, false);
    }
    const std::uint64_t distance = record / 8 + 1 - list.before;
    list.before = record / 8 + 1;
    list.bytes += distance < 64 ? 1 : 2;
    for (std::uint64_t left = distance < 64 ? 1 : 2; left > 0;) {
      if (room(list) == 0) {
        access(list.chunks.back().first + list.chunks.back().second, 4, true);
        list.chunks.push_back({end() + chunk_bytes * chunks++, 0});
      }
      const std::uint64_t here = std::min(room(list), left);
      access(list.chunks.back().first + list.chunks.back().second, here, true);
      list.chunks.back().second += here;
      left -= here;
    }
    access(list.chunks.back().first + list.chunks.back().second, room(list) > 0 ? 1 : 4, true);
    access(cursor, 8, true);
  }
  void finish() {
    while (!cache.empty()) flush_last();
    read += round_up((lists + 7) / 8, burst);
  }
  // Bytes that a tile core reads of one list, and their bursts.
  std::uint64_t list_bytes(QueueIndex number) {
    const List& list = queues[number];
    return list.chunks.empty() ? 0 : list.bytes + 4 * (list.chunks.size() - 1) + (room(list) > 0 ? 1 : 4);
  }
  std::uint64_t list_bursts(QueueIndex number) {
    const List& list = queues[number];
    std::uint64_t sum = 0;
    for (std::size_t c = 0; c < list.chunks.size(); ++c) {
      const bool last = c + 1 == list.chunks.size();
      const std::uint64_t address = list.chunks[c].first,
                          bytes = list.chunks[c].second + (!last || room(list) == 0 ? 4 : 1);
      sum += (address + bytes - 1) / burst - address / burst + 1;
    }
    return sum;
  }
  std::uint64_t content() {
    std::uint64_t sum = (lists + 7) / 8 + record_bytes;
    for (const auto& [number, list] : queues) sum += 8 + list_bytes(number);
    return sum;
  }
};

// Appends at random; returns whether the ledger and the counter agree with an oracle that has `oracle_lines` lines.
bool traffic_agrees(std::uint32_t seed, std::int64_t burst, std::int64_t chunk, std::int64_t lines,
                    std::int64_t oracle_lines) {
  Random random(seed);
  gpu::GpuConfiguration gpu;
  gpu.memory.burst_bytes = burst;
  gpu.parameter_buffer.chunk_bytes = chunk;
  gpu.binner.combining_bursts = lines;
  constexpr QueueIndex kQueues = 23;
  ParameterBuffer buffer(gpu.binner_spec(), kQueues);
  const auto b = static_cast<std::uint64_t>(burst);
  TrafficOracle oracle;
  oracle.burst = b;
  oracle.lines = static_cast<std::uint64_t>(oracle_lines);
  oracle.first_chunk_bytes = 32;
  oracle.chunk_bytes = static_cast<std::uint64_t>(chunk);
  oracle.table = 10 << 20;
  oracle.lists = kQueues;
  oracle.begin();
  for (int n = 0; n < 900; ++n) {
    const auto queue = static_cast<QueueIndex>(random.coin() ? random.integer(0, kQueues - 2) : random.integer(3, 5));
    const std::vector<ListLevels::Placement> one = {{queue, {}}};
    std::uint32_t next = 0;
    ListEntry sub_patch;  // whole, or a part of a patch
    sub_patch.whole = random.coin();
    EXPECT_TRUE(buffer.append(sub_patch, one, next));
    oracle.append(queue, sub_patch.whole ? 8 : 16);
  }
  buffer.finish();
  oracle.finish();
  const memory::Traffic& binner = buffer.ledger().traffic(memory::Unit::kBinner, memory::Purpose::kTileQueue);
  bool agrees = binner.read_bytes == oracle.read && binner.written_bytes == oracle.written &&
                buffer.counters().queue_bytes_written == oracle.content();
  for (QueueIndex queue = 0; queue < kQueues; ++queue) {
    memory::Ledger ledger;
    std::uint64_t payload = 0;
    std::vector<ListEntry> entries;
    buffer.read_queue(queue, entries, ledger, payload);
    agrees =
        agrees && ledger.total().read_bytes == oracle.list_bursts(queue) * b && payload == oracle.list_bytes(queue);
  }
  return agrees;
}

TEST(QueueTraffic, PB3LI3EveryBurstFollowsFromAReplayOfTheAccesses) {
  std::uint32_t seed = 1;
  for (const std::int64_t burst : {16, 32, 64, 128})
    for (const std::int64_t chunk : {64, 128, 1024})
      for (const std::int64_t lines : {1, 3, 16, 4096})
        EXPECT_TRUE(traffic_agrees(seed++, burst, chunk, lines, lines)) << burst << " " << chunk << " " << lines;
}

TEST(QueueTrafficTwin, OneLineLessInFrontOfMemoryIsCaught) { EXPECT_FALSE(traffic_agrees(1, 32, 256, 16, 15)); }

// ---- The binner's hard cases ------------------------------------------------------------------------------------

BoundedSubPatch rectangle(std::uint32_t patch, float x0, float y0, float x1, float y1) {
  // No box, no hull: its bounds alone say where it is.
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  frontend::MovingBox box{};
  for (auto& low : box.low) low.fill(kNone);
  return {patch, {0, 0, 1, 1}, {x0, y0, x1, y1, 0, 1, 2, false}, box};
}

// Entries that every tile reads, over as many passes as the buffer needs.
std::map<TileIndex, std::multiset<int>> read_all(Binner& binner, const PosedObject& scene,
                                                 std::span<const BoundedSubPatch> sub_patches, int& passes) {
  std::map<TileIndex, std::multiset<int>> tiles;
  Binner::Cursor cursor;
  for (bool done = false; !done; ++passes) {
    done = binner.run(*scene.frame, sub_patches, cursor);
    for (TileIndex t = 0; t < binner.grid().tile_count(); ++t) {
      memory::Ledger ledger;
      std::uint64_t payload = 0;
      for (const ListEntry& e : binner.read_tile(*scene.frame, t, ledger, payload)) tiles[t].insert(e.range.i0);
    }
    binner.reset();
  }
  return tiles;
}

gpu::GpuConfiguration gpu_with(std::int64_t bytes, int levels) {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = bytes;
  gpu.parameter_buffer.chunk_bytes = 128;
  gpu.binner.queue_levels = levels;
  return gpu;
}

TEST(HardCases, LevelsOfQueuesAndPartialRendersGiveEveryTileItsSubPatchesOnce) {
  const PosedObject scene;
  Random random(3);
  std::vector<BoundedSubPatch> sub_patches;
  for (int n = 0; n < 70; ++n) {
    const float x = random.uniform(-40, 160), y = random.uniform(-40, 160);
    sub_patches.push_back(
        rectangle(static_cast<std::uint32_t>(n % 6), x, y, x + random.uniform(0, 150), y + random.uniform(0, 150)));
    sub_patches.back().range.i0 = static_cast<std::uint8_t>(n);
  }
  const TileGrid grid(130, 125, 16, 16);
  int passes = 0;
  Binner flat(gpu_with(1 << 20, 1).binner_spec(), grid);
  const auto expected = read_all(flat, scene, sub_patches, passes);
  EXPECT_EQ(passes, 1);
  for (const int levels : {2, 3, 5}) {
    Binner binner(gpu_with(4416, levels).binner_spec(), grid);
    passes = 0;
    auto tiles = read_all(binner, scene, sub_patches, passes);
    EXPECT_GT(passes, 1);
    EXPECT_LT(binner.buffer().counters().entries, flat.buffer().counters().entries);
    EXPECT_EQ(binner.buffer().counters().tile_overlaps, flat.buffer().counters().tile_overlaps);
    for (const auto& [tile, wanted] : expected)
      for (const int n : wanted) EXPECT_EQ(tiles[tile].count(n), 1u) << levels << " levels, tile " << tile;
  }
}

TEST(HardCases, APatchInEveryTileOfMoreThan65535) {
  const PosedObject scene;
  const std::vector<BoundedSubPatch> one = {rectangle(0, -1e9f, -1e9f, 1e9f, 1e9f)};
  for (const auto& [levels, entries] : {std::pair{1, 512u * 512u}, {3, 128u * 128u}, {5, 32u * 32u}}) {
    Binner binner(gpu_with(64 << 20, levels).binner_spec(), TileGrid(16384, 16384, 32, 32));
    Binner::Cursor cursor;
    ASSERT_TRUE(binner.run(*scene.frame, one, cursor));
    EXPECT_EQ(binner.buffer().counters().entries, entries);
    EXPECT_EQ(binner.buffer().counters().tile_overlaps, 512u * 512u);
    memory::Ledger ledger;
    std::uint64_t payload = 0;
    EXPECT_EQ(binner.read_tile(*scene.frame, 70000, ledger, payload).size(), 1u);
    EXPECT_EQ(payload, 1u + 1u) << "an entry, and the end of its list";
  }
}

TEST(HardCases, FramesOfOnePixelAndOfNoMultipleOfATile) {
  const PosedObject scene;
  for (const auto& [width, height] : {std::pair{1, 1}, {33, 1}, {1, 65}, {97, 31}})
    for (const int levels : {1, 5}) {
      Binner binner(gpu_with(1 << 16, levels).binner_spec(), TileGrid(width, height, 32, 32));
      const std::vector<BoundedSubPatch> all = {
          rectangle(0, 0, 0, static_cast<float>(width), static_cast<float>(height)),
          rectangle(1, 0.25f, 0.25f, 0.5f, 0.5f)};
      int passes = 0;
      const auto tiles = read_all(binner, scene, all, passes);
      EXPECT_EQ(tiles.size(), binner.grid().tile_count());
      EXPECT_EQ(tiles.at(0).size(), 2u);
    }
}

TEST(HardCases, OffScreenOnAnySideGivesNoEntryAtAnyLevel) {
  const PosedObject scene;
  const std::vector<BoundedSubPatch> outside = {rectangle(0, -90, 10, -1, 20), rectangle(0, 129, 10, 300, 20),
                                                rectangle(0, 10, -90, 20, -1), rectangle(0, 10, 129, 20, 300)};
  for (const int levels : {1, 4}) {
    Binner binner(gpu_with(1 << 16, levels).binner_spec(), TileGrid(128, 128, 32, 32));
    Binner::Cursor cursor;
    EXPECT_TRUE(binner.run(*scene.frame, outside, cursor));
    EXPECT_EQ(binner.buffer().counters().entries, 0u);
    EXPECT_EQ(binner.buffer().counters().tile_overlaps, 0u);
  }
}

TEST(HardCases, FirstChunksOfAllLevelsMustFitAndExactlyEnoughSuffices) {
  // 16 lists: 64 + 128 + 512 bytes; 16 + 4 + 1: 64 + 192 + 704. Then a chunk and a burst of records.
  const TileGrid grid(128, 128, 32, 32);
  EXPECT_NO_THROW(Binner(gpu_with(704 + 128 + 64, 1).binner_spec(), grid));
  EXPECT_NO_THROW(Binner(gpu_with(960 + 128 + 64, 3).binner_spec(), grid));
  try {
    Binner(gpu_with(960 + 128 + 63, 3).binner_spec(), grid);
    FAIL() << "accepted a buffer that cannot hold one chunk";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("21 lists (960 bytes)"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tessera::binner::queue_test
