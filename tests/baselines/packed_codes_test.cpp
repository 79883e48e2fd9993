// Grids of indices, snapped positions and compressed colours: back to what they were made of, and how small they are.
#include <gtest/gtest.h>

#include <bit>
#include <map>

#include "baselines/block_code.h"
#include "baselines/compressed_color.h"
#include "memory/lru_cache.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/support/captures.h"

namespace tessera::baselines {
namespace {

using test::Random;

// ---- Grids ------------------------------------------------------------------------------------------------------

TEST(GridCode, AnyRectanglesWithAnyTrianglesComeBack) {
  Random random(1);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<GridRectangle> rectangles;
    std::size_t triangles = 0, vertices = 0, bytes = 0;
    for (int n = random.integer(1, 4); n > 0; --n) {
      GridRectangle r;
      r.columns = static_cast<std::uint8_t>(random.integer(1, 7));
      r.rows = static_cast<std::uint8_t>(random.integer(1, 7));
      const int kept = random.integer(1, 8), cells = r.columns * r.rows;
      std::set<std::pair<int, int>> used;
      for (int t = 0; t < 2 * cells; ++t) {
        if (random.integer(1, 8) > kept) continue;
        r.triangles.set(static_cast<std::size_t>(t));
        const int i = t / 2 % r.columns, j = t / 2 / r.columns;
        used.insert({i, j});
        used.insert({i + 1, j + 1});
        used.insert(t % 2 == 0 ? std::pair{i, j + 1} : std::pair{i + 1, j});
      }
      const std::size_t count = r.triangles.count();
      if (triangles + count > kBlockTriangles || vertices + used.size() > kBlockVertices) break;
      triangles += count;
      vertices += used.size();
      bytes += 1 + (count == std::size_t{2} * static_cast<std::size_t>(cells)
                        ? 0u
                        : static_cast<std::size_t>((2 * cells + 7) / 8));
      rectangles.push_back(r);
    }
    const std::vector<std::uint8_t> coded = encode_grids(rectangles);
    EXPECT_EQ(coded.size(), bytes);
    const std::vector<BlockTriangle> back = decode_grids(coded, triangles);
    EXPECT_EQ(back, test::decode_grid_bytes(coded, triangles));
    EXPECT_EQ(back.size(), triangles);
    std::set<std::uint8_t> numbers;
    for (const BlockTriangle& t : back) numbers.insert(t.begin(), t.end());
    EXPECT_EQ(numbers.size(), vertices);
    EXPECT_TRUE(vertices == 0 || *numbers.rbegin() == vertices - 1);
  }
}

TEST(GridCodeTwin, AMissingTriangleIsCaught) {
  GridRectangle r{3, 2, {}};
  for (std::size_t t = 0; t < 12; ++t) r.triangles.set(t);
  const std::vector<BlockTriangle> whole = decode_grids(encode_grids(std::span(&r, 1)), 12);
  r.triangles.reset(5);
  const std::vector<BlockTriangle> part = decode_grids(encode_grids(std::span(&r, 1)), 11);
  EXPECT_NE(std::vector(whole.begin(), whole.begin() + 11), part);
}

// ---- Positions --------------------------------------------------------------------------------------------------

std::vector<std::array<float, 6>> snapped_positions(Random& random, std::size_t count, bool moving, float size) {
  std::vector<std::array<float, 6>> out(count);
  const float x = random.uniform(-500, 2000), y = random.uniform(-500, 2000), z = random.uniform(0.1f, 900);
  for (auto& p : out) {
    const auto on_grid = [](float v) { return std::round(v * 256) / 256; };
    p = {on_grid(x + random.uniform(0, size)), on_grid(y + random.uniform(0, size)), z * random.uniform(1, 1.01f)};
    if (moving)
      p[3] = on_grid(p[0] + random.uniform(-9, 9)), p[4] = on_grid(p[1] + random.uniform(-9, 9)),
      p[5] = p[2] * random.uniform(0.9f, 1.1f);
  }
  return out;
}

TEST(PositionCode, EveryBitOfEveryPositionComesBack) {
  Random random(2);
  for (int trial = 0; trial < 400; ++trial) {
    const bool moving = random.coin();
    const std::size_t words = moving ? kMovingWords : kStillWords,
                      count = static_cast<std::size_t>(random.integer(1, 64));
    const auto positions = snapped_positions(random, count, moving, random.coin() ? 12.0f : 3000.0f);
    std::vector<PositionWords> coded;
    for (const auto& p : positions) {
      const auto of = position_words(p, words);
      ASSERT_TRUE(of);
      EXPECT_EQ(position_of(*of, words), p);
      coded.push_back(*of);
    }
    const std::vector<std::uint8_t> bytes = encode_positions(coded, words);
    EXPECT_EQ(decode_positions(bytes, count, words), coded);
    EXPECT_EQ(position_bytes(bytes, count, words), bytes.size());
    std::size_t taken = 0;
    const auto back = test::decode_position_bits(bytes, count, moving, taken);
    EXPECT_EQ(taken, bytes.size());
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t c = 0; c < words; ++c)
        EXPECT_EQ(std::bit_cast<std::uint32_t>(back[v][c]), std::bit_cast<std::uint32_t>(positions[v][c]));
  }
}

TEST(PositionCode, WhatIsNotOnTheGridIsRefused) {
  EXPECT_TRUE(position_words({1.5f, -2.25f, 7.1f}, kStillWords));
  for (const float x : {1.0f + 0x1p-9f, 0x1p22f, -0.0f, std::numeric_limits<float>::infinity(),
                        std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_FALSE(position_words({x, 0, 1}, kStillWords));
    EXPECT_FALSE(position_words({0, x, 1}, kStillWords));
    EXPECT_FALSE(position_words({0, 0, 1, 0, x, 1}, kMovingWords));
  }
}

// A grid of an eighth of a pixel a cell, row by row: deltas are small but at the ends of rows, offsets are not.
TEST(PositionCode, TakesTheFewerBitsOfOffsetsAndDeltas) {
  std::vector<PositionWords> vertices;
  for (std::uint32_t v = 0; v < 64; ++v) vertices.push_back({1000 + v * 32, 5000, 77});
  // Offsets up to 2016: 11 bits. Deltas of 32, in zigzag 64: 7 bits.
  EXPECT_EQ(encode_positions(vertices, kStillWords).size(), 3u * 5 + 64 * 7 / 8);
  for (std::uint32_t v = 0; v < 64; ++v) vertices[v][0] = 1000 + v % 2 * 32;
  // Offsets: 6 bits. Deltas of 32 and -32: 7 bits.
  EXPECT_EQ(encode_positions(vertices, kStillWords).size(), 3u * 5 + 64 * 6 / 8);
}

// ---- Colours ----------------------------------------------------------------------------------------------------

// From the description of the format.
std::vector<std::uint32_t> decode_color_bytes(std::span<const std::uint8_t> bytes, std::size_t count) {
  std::vector<std::uint32_t> out(count, 0);
  std::size_t bit = 9 * 8;
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t c = 0; c < 4; ++c) {
      std::uint32_t value = 0;
      if (bytes[0] == 0) value = bytes[1 + c];
      if (bytes[0] == 2) value = bytes[1 + 4 * k + c];
      if (bytes[0] == 1) {
        value = bytes[1 + c];
        for (int b = 0; b < bytes[5 + c]; ++b, ++bit) value += (bytes[bit / 8] >> bit % 8 & 1u) << b;
      }
      out[k] += value << (8 * c);
    }
  return out;
}

TEST(ColorCode, EveryBlockComesBackInTheSmallestKind) {
  Random random(3);
  std::array<int, 3> kinds{};
  for (int trial = 0; trial < 600; ++trial) {
    const auto count = static_cast<std::size_t>(random.integer(1, 64));
    const int spread = random.integer(0, 2) * random.integer(0, 255);
    std::vector<std::uint32_t> colors(count);
    std::array<int, 4> base;
    for (int& b : base) b = random.integer(0, 255);
    for (std::uint32_t& color : colors)
      for (std::size_t c = 0; c < 4; ++c)
        color |= static_cast<std::uint32_t>(std::clamp(base[c] + random.integer(-spread, spread) / 2, 0, 255))
                 << (8 * c);
    const std::vector<std::uint8_t> bytes = encode_colors(colors);
    EXPECT_EQ(decode_colors(bytes, count), colors);
    EXPECT_EQ(decode_color_bytes(bytes, count), colors);
    EXPECT_EQ(color_code_bytes(colors), bytes.size());
    EXPECT_LE(bytes.size(), 1 + 4 * count);
    ++kinds.at(bytes[0]);
  }
  for (const int kind : kinds) EXPECT_GT(kind, 20);
}

TEST(ColorCodeTwin, OneWrongBitIsCaught) {
  const std::vector<std::uint32_t> colors = {0xFF102030, 0xFF102131, 0xFF112030};
  std::vector<std::uint8_t> bytes = encode_colors(colors);
  bytes.back() ^= 1;
  EXPECT_NE(decode_colors(bytes, 3), colors);
}

// ---- Compressed colour in memory ----------------------------------------------------------------------------------

constexpr std::uint64_t kBurst = 64;

// 64 pixels a side with 4 samples: lines of 2x2 pixels, 32 in a row; 8 blocks in a row.
const SampleLayout& layout() {
  static const SampleLayout kLayout({0, 0, 64, 64}, 4, kBurst);
  return kLayout;
}

TEST(CompressedColor, AConstantBlockTakesOneBurstAndMetadataOneInSixtyFour) {
  CompressedColorMemory memory(1 << 20, kBurst, layout());
  const std::vector<std::uint32_t> red = {0xFF0000FF};
  const std::vector<ColorWrite> all = {{0xFFFF, 0}};
  for (std::uint32_t line = 0; line < layout().line_count(); ++line) memory.draw({line, true, false, 0, 1}, all, red);
  memory.finish(true);
  EXPECT_EQ(layout().line_count(), 1024u);
  EXPECT_EQ(memory.bytes_read(), 0u);
  // Depth of each line; 256 blocks; their metadata.
  EXPECT_EQ(memory.bytes_written(), (1024 + 256 + 256 / 64) * kBurst);
  for (const std::uint32_t color : memory.colors()) EXPECT_EQ(color, red[0]);
}

TEST(CompressedColor, WhatBlendsIsMixed) {
  CompressedColorMemory memory(1 << 20, kBurst, layout());
  const std::vector<std::uint32_t> colors = {0xFF0000FF, 0x8000FF00};
  memory.draw({0, true, false, 0, 1}, std::vector<ColorWrite>{{0x1, 0}}, colors);
  memory.draw({0, true, true, 0, 1}, std::vector<ColorWrite>{{0x1, 1}}, colors);
  EXPECT_EQ(memory.colors()[0] & 255u, 127u);
  EXPECT_EQ(memory.colors()[0] >> 8 & 255u, 128u);
  EXPECT_EQ(memory.colors()[1], 0u);
}

// An obvious machine: a list of what is on chip, and blocks compressed by the real encoder and kept.
struct PlainMachine {
  explicit PlainMachine(std::uint64_t capacity) : chip(capacity - capacity / 16), metadata(capacity / 16) {}
  memory::LruCache chip, metadata;
  std::vector<std::uint32_t> colors = std::vector<std::uint32_t>(1024 * 16, 0);
  std::map<std::uint32_t, std::vector<std::uint8_t>> blocks;
  std::set<std::uint32_t> depth, metadata_lines;
  std::uint64_t read = 0, written = 0;
  int wrong = 0;

  std::vector<std::uint32_t> block_colors(std::uint32_t block) const {
    return {colors.begin() + block * 64, colors.begin() + block * 64 + 64};
  }
  void touch_metadata(std::uint32_t block, bool change) {
    const bool known = metadata_lines.contains(block / 64);
    if (!metadata.use(block / 64, kBurst, change,
                      [&](std::uint32_t line) { metadata_lines.insert(line), written += kBurst; }) &&
        known)
      read += kBurst;
  }
  void leave(std::uint32_t key) {
    if (key < 1024) {
      depth.insert(key);
      written += kBurst;
      return;
    }
    std::vector<std::uint8_t> bytes = encode_colors(block_colors(key - 1024));
    if (bytes.size() > 256) bytes.erase(bytes.begin());  // as it is; metadata says so
    written += (bytes.size() + 63) / 64 * 64;
    blocks[key - 1024] = bytes;
    touch_metadata(key - 1024, true);
  }
  void use(std::uint32_t key, std::uint64_t bytes, bool change, const std::vector<std::uint32_t>& before) {
    std::uint64_t fetched = key < 1024 ? (depth.contains(key) ? kBurst : 0) : 0;
    const auto found = key < 1024 ? blocks.end() : blocks.find(key - 1024);
    if (found != blocks.end()) fetched = (found->second.size() + 63) / 64 * 64;
    const std::vector<std::uint8_t> stored = found == blocks.end() ? std::vector<std::uint8_t>{} : found->second;
    if (chip.use(key, bytes, change, [&](std::uint32_t k) { leave(k); })) return;
    read += fetched;
    if (key >= 1024) touch_metadata(key - 1024, false);
    if (stored.empty() || stored.size() == 256) return;  // clear, or as it is
    if (decode_colors(stored, 64) != before) ++wrong;
  }
  void draw(const LineTouch& touch, std::span<const ColorWrite> writes, std::span<const std::uint32_t> of) {
    use(touch.line, kBurst, touch.passes && !touch.blends, {});
    if (!touch.passes) return;
    const std::vector<std::uint32_t> before = block_colors(touch.line / 4);
    for (const ColorWrite& write : writes)
      for (std::size_t k = 0; k < 16; ++k)
        if ((write.samples >> k & 1u) != 0) colors[touch.line * 16 + k] = of[write.point];
    use(1024 + touch.line / 4, 256, true, before);
  }
};

TEST(CompressedColor, CC1CC2WhatIsReadWasWrittenAndDecodesToTheColorsThatLeft) {
  for (const std::uint64_t capacity : {std::uint64_t{0}, std::uint64_t{2048}, std::uint64_t{16384}}) {
    Random random(4);
    CompressedColorMemory memory(capacity, kBurst, layout());
    PlainMachine plain(capacity);
    for (int n = 0; n < 6000; ++n) {
      const std::vector<std::uint32_t> colors = {
          0xFF000000u + static_cast<std::uint32_t>(random.integer(0, random.coin() ? 3 : 0xFFFFFF)), 0xFF808080u};
      const auto samples = static_cast<std::uint64_t>(random.integer(1, 0xFFFF));
      const std::vector<ColorWrite> writes = {{samples & 0xFF, 0}, {samples & 0xFF00, 1}};
      const LineTouch touch{static_cast<std::uint32_t>(random.integer(0, random.coin() ? 40 : 1023)),
                            random.integer(0, 3) > 0, false, 0, 2};
      memory.draw(touch, writes, colors);
      plain.draw(touch, writes, colors);
    }
    EXPECT_EQ(memory.bytes_read(), plain.read) << capacity;
    EXPECT_EQ(memory.bytes_written(), plain.written) << capacity;
    EXPECT_EQ(plain.wrong, 0);
    EXPECT_TRUE(std::equal(plain.colors.begin(), plain.colors.end(), memory.colors().begin()));
  }
}

}  // namespace
}  // namespace tessera::baselines
