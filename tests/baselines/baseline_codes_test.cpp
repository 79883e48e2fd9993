// Data that a machine with triangle bins writes: strips, references, lists; and the cache that all baselines share.
#include <list>

#include "baselines/block_code.h"
#include "baselines/tile_reference.h"
#include "baselines/triangle_buffer.h"
#include "gpu/configuration.h"
#include "memory/lru_cache.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/support/tests.h"

namespace tessera::baselines::baseline_codes_test {
namespace {

// ---- Strips -----------------------------------------------------------------------------------------------------

BlockTriangle turned(const BlockTriangle& t) {
  return std::min({t, BlockTriangle{t[1], t[2], t[0]}, BlockTriangle{t[2], t[0], t[1]}});
}
// Equal but for rotation, which keeps the winding.
bool same_triangles(const std::vector<BlockTriangle>& a, const std::vector<BlockTriangle>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t t = 0; t < a.size(); ++t)
    if (turned(a[t]) != turned(b[t])) return false;
  return true;
}

// Numbers vertices by first use.
std::vector<BlockTriangle> numbered(const std::vector<std::array<int, 3>>& triangles) {
  std::map<int, std::uint8_t> numbers;
  std::vector<BlockTriangle> out;
  for (const auto& t : triangles) {
    BlockTriangle n;
    for (std::size_t k = 0; k < 3; ++k)
      n[k] = numbers.try_emplace(t[k], static_cast<std::uint8_t>(numbers.size())).first->second;
    out.push_back(n);
  }
  return out;
}

// Cells of a grid in the order of the tessellator; a share of its triangles is culled.
std::vector<BlockTriangle> grid(int columns, int rows, int culled_of_8, Random& random) {
  std::vector<std::array<int, 3>> triangles;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int a = j * (columns + 1) + i, b = a + 1, c = b + columns + 1, d = c - 1;
      if (random.integer(0, 7) >= culled_of_8) triangles.push_back({a, c, d});
      if (random.integer(0, 7) >= culled_of_8) triangles.push_back({a, b, c});
    }
  return numbered(triangles);
}

TEST(StripCode, DecodesToTheTrianglesOfAnyGridWhateverIsCulled) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const auto triangles = grid(random.integer(1, 7), random.integer(1, 7), random.integer(0, 7), random);
    const auto bytes = encode_strip(triangles);
    EXPECT_TRUE(same_triangles(test::decode_strip_bits(bytes, triangles.size()), triangles));
    EXPECT_TRUE(same_triangles(decode_strip(bytes, triangles.size()), triangles));
  }
}

TEST(StripCode, DecodesAnyTrianglesDegenerateOnesToo) {
  Random random(2);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::array<int, 3>> triangles;
    const int vertices = random.integer(1, 64);
    for (int t = random.integer(1, 126); t > 0; --t)
      triangles.push_back({random.integer(1, vertices), random.integer(1, vertices), random.integer(1, vertices)});
    const auto expected = numbered(triangles);
    EXPECT_TRUE(same_triangles(test::decode_strip_bits(encode_strip(expected), expected.size()), expected));
  }
}

TEST(StripCode, AWholeGroupTakesTheBytesOfTheHeader) {
  // 7x7 cells: each row begins with three vertices; along the first row all are new, later one of each cell's two
  // further ones is old.
  Random random(3);
  const auto triangles = grid(7, 7, 0, random);
  std::size_t bits = 0;
  std::set<int> seen;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const bool row_begins = t % 14 == 0;
    bits += 2;
    std::size_t fresh = 0;
    for (const std::uint8_t v : triangles[t]) fresh += seen.insert(v).second ? 1u : 0u;
    const std::size_t listed = row_begins ? 3 : 1;
    bits += fresh + 7 * (listed - fresh);
  }
  EXPECT_EQ(encode_strip(triangles).size(), (bits + 7) / 8);
  EXPECT_LT(bits, 98u * 18u / 2u);  // less than half of plain 6-bit indices
}

TEST(StripCodeTwin, AnotherWindingOrVertexIsCaught) {
  Random random(4);
  const auto triangles = grid(5, 4, 1, random);
  auto flipped = triangles, moved = triangles;
  std::swap(flipped[3][0], flipped[3][1]);
  moved.back()[0] = static_cast<std::uint8_t>((moved.back()[0] + 1) % 3);
  EXPECT_FALSE(same_triangles(test::decode_strip_bits(encode_strip(flipped), triangles.size()), triangles));
  EXPECT_FALSE(same_triangles(moved, triangles));
}

// ---- References -------------------------------------------------------------------------------------------------

TEST(TileReference, EverySetOfTrianglesComesBackInTheSmallestForm) {
  Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto count = static_cast<std::size_t>(random.integer(1, 126));
    TileReference reference{static_cast<std::uint64_t>(random.integer(0, 1 << 24)) * kBlockAlignment, {}};
    const int density = random.integer(1, 8), blobs = random.integer(0, 1);
    bool on = random.coin();
    for (std::size_t t = 0; t < count; ++t) {
      if (blobs == 0 || random.integer(0, 9) == 0) on = random.integer(1, 8) <= density;
      reference.triangles.set(t, on);
    }
    if (reference.triangles.none()) reference.triangles.set(count - 1);
    const std::uint64_t before = reference.address / 2 / kBlockAlignment * kBlockAlignment;
    std::vector<std::uint8_t> bytes;
    encode_reference(reference, count, before, bytes);

    const test::DecodedReference back = test::decode_reference_bytes(bytes, count, before);
    EXPECT_EQ(back.address, reference.address);
    EXPECT_EQ(back.triangles, reference.triangles);
    EXPECT_EQ(back.bytes, bytes.size());
    // Sizes of the forms from their descriptions.
    const std::size_t taken = reference.triangles.count();
    std::size_t runs = 0, address_bytes = 1;
    for (std::size_t t = 0; t < count; ++t)
      runs += reference.triangles[t] && (t == 0 || !reference.triangles[t - 1]) ? 1u : 0u;
    for (std::uint64_t delta = (reference.address - before) / kBlockAlignment; delta >= 128; delta /= 128)
      ++address_bytes;
    std::size_t smallest = taken == count ? 0 : (count + 7) / 8;
    if (taken <= 64) smallest = std::min(smallest, taken);
    if (runs <= 64) smallest = std::min(smallest, 2 * runs);
    EXPECT_EQ(bytes.size(), address_bytes + 1 + smallest) << taken << " of " << count << ", " << runs << " runs";
  }
}

// ---- Lists and blocks in memory ---------------------------------------------------------------------------------

gpu::GpuConfiguration machine(std::int64_t lines) {
  gpu::GpuConfiguration gpu;
  gpu.binner.combining_bursts = lines;
  gpu.parameter_buffer.chunk_bytes = 128;
  return gpu;
}

TEST(TriangleBuffer, TB1ListsComeBackAsTheyWereAppendedAcrossChunks) {
  Random random(6);
  TriangleBuffer buffer(machine(7), 9);
  std::map<binner::TileIndex, std::vector<std::uint8_t>> lists;
  std::map<std::uint64_t, std::vector<std::uint8_t>> blocks;
  for (int n = 0; n < 500; ++n) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(random.integer(1, 30)));
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random.integer(0, 255));
    if (random.integer(0, 3) == 0) {
      blocks[buffer.store_block(bytes)] = bytes;
    } else {
      const auto tile = static_cast<binner::TileIndex>(random.integer(0, 7));
      buffer.append(tile, bytes);
      lists[tile].insert(lists[tile].end(), bytes.begin(), bytes.end());
    }
  }
  buffer.finish();
  std::uint64_t read = 0, expected = 0;
  for (binner::TileIndex tile = 0; tile < 9; ++tile) {
    memory::Ledger ledger;
    EXPECT_EQ(buffer.read_list(tile, ledger, read), lists[tile]);
    // 28 bytes in the first chunk, then 124; links, and a byte or a link that ends it.
    const std::size_t size = lists[tile].size(), behind = size > 28 ? size - 28 : 0, chunks = (behind + 123) / 124;
    const bool full = behind > 0 ? behind % 124 == 0 : size == 28;
    expected += size == 0 ? 0 : size + 4 * chunks + (full ? 4 : 1);
  }
  EXPECT_EQ(read, expected);
  for (const auto& [address, bytes] : blocks) {
    EXPECT_EQ(address % kBlockAlignment, 0u);
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), buffer.memory().begin() + static_cast<std::ptrdiff_t>(address)));
  }
}

TEST(TriangleBuffer, TB2WithRoomForAllBurstsEachLeavesOnceAndWithoutManyLeaveTwice) {
  for (const std::int64_t lines : {4096, 2}) {
    TriangleBuffer buffer(machine(lines), 4);  // bits, cursors: a burst of 64 each; first chunks: two
    const std::vector<std::uint8_t> block(100, 1), reference(5, 2);
    for (int n = 0; n < 30; ++n) {
      buffer.store_block(block);
      for (binner::TileIndex tile = 0; tile < 4; ++tile) buffer.append(tile, reference);
    }
    buffer.finish();
    const std::uint64_t bursts = (buffer.bytes_in_use() + 63) / 64 * 64;
    // Lists of 150 bytes: 28 in the first chunk, 122 in another.
    const std::uint64_t used = bursts;
    if (lines == 4096)
      EXPECT_EQ(buffer.ledger().total().written_bytes, used);
    else
      EXPECT_GT(buffer.ledger().total().written_bytes, 2 * used);
    EXPECT_EQ(buffer.ledger().total().read_bytes == 64, lines == 4096) << "the bits, for the tile scheduler";
    EXPECT_EQ(buffer.bytes_written(), 30u * 100 + 1 + 4 * (8 + 4 + 150 + 1));
  }
}

TEST(TriangleBuffer, AFullBufferIsTakenAgainAndCounted) {
  gpu::GpuConfiguration gpu = machine(16);
  gpu.parameter_buffer.bytes = 256 + 192;
  TriangleBuffer buffer(gpu, 4);
  const std::vector<std::uint8_t> block(64, 0);
  for (int n = 0; n < 3; ++n) buffer.store_block(block);
  EXPECT_EQ(buffer.bytes_in_use(), 256u + 192);
  EXPECT_EQ(buffer.overflows(), 0u);  // exactly full
  buffer.store_block(block);
  EXPECT_EQ(buffer.overflows(), 1u);
}

// ---- The cache --------------------------------------------------------------------------------------------------

// Obvious: a list in order of use.
struct CacheOracle {
  std::uint64_t capacity;
  struct Item {
    std::uint32_t key;
    std::uint64_t bytes;
    bool changed;
  };
  std::list<Item> items;
  std::vector<std::uint32_t> written;
  std::uint64_t in_use() const {
    std::uint64_t sum = 0;
    for (const Item& i : items) sum += i.bytes;
    return sum;
  }
  void drop_last() {
    if (items.back().changed) written.push_back(items.back().key);
    items.pop_back();
  }
  bool use(std::uint32_t key, std::uint64_t bytes, bool change) {
    if (bytes > capacity) {
      if (change) written.push_back(key);
      return false;
    }
    const auto found = std::find_if(items.begin(), items.end(), [&](const Item& i) { return i.key == key; });
    const bool hit = found != items.end();
    if (hit) change = change || found->changed, items.erase(found);
    while (in_use() + bytes > capacity) drop_last();
    items.push_front({key, bytes, change});
    return hit;
  }
};

// Uses at random; whether cache and oracle agree on every hit and every write.
bool caches_agree(std::uint32_t seed, std::uint64_t capacity, std::uint64_t oracle_capacity) {
  Random random(seed);
  memory::LruCache cache(capacity);
  CacheOracle oracle{oracle_capacity, {}, {}};
  std::vector<std::uint32_t> written;
  const auto write_back = [&](std::uint32_t key) { written.push_back(key); };
  bool agree = true;
  for (int n = 0; n < 3000; ++n) {
    const auto key = static_cast<std::uint32_t>(random.coin() ? random.integer(0, 9) : random.integer(0, 60));
    const std::uint64_t bytes = 8 + key % 7 * 16;
    const bool change = random.coin();
    agree = agree && cache.use(key, bytes, change, write_back) == oracle.use(key, bytes, change);
    agree = agree && cache.bytes_in_use() == oracle.in_use() && cache.bytes_in_use() <= capacity;
  }
  cache.flush(write_back);
  while (!oracle.items.empty()) oracle.drop_last();
  return agree && written == oracle.written && cache.bytes_in_use() == 0;
}

TEST(LruCache, LRU1LRU2IsAListInOrderOfUse) {
  std::uint32_t seed = 1;
  for (const std::uint64_t capacity : {0u, 8u, 50u, 104u, 400u, 2000u, 100000u})
    EXPECT_TRUE(caches_agree(seed++, capacity, capacity)) << capacity;
}

TEST(LruCacheTwin, OneByteLessIsCaught) { EXPECT_FALSE(caches_agree(1, 400, 399)); }

TEST(LruCache, LRU3WithoutCapacityNothingHitsWithUnlimitedEachKeyMissesOnce) {
  memory::LruCache none(0), all(memory::LruCache::kUnlimited);
  int none_hits = 0, all_misses = 0;
  for (int n = 0; n < 1000; ++n) {
    none_hits += none.use(static_cast<std::uint32_t>(n % 37), 64) ? 1 : 0;
    all_misses += all.use(static_cast<std::uint32_t>(n % 37), 64) ? 0 : 1;
  }
  EXPECT_EQ(none_hits, 0);
  EXPECT_EQ(all_misses, 37);
}

}  // namespace
}  // namespace tessera::baselines::baseline_codes_test
