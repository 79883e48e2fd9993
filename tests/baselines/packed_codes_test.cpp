// Grids of indices, places of vertices and compressed colours: decoding gives back the input, and the codes are
// small.
#include "baselines/block_code.h"
#include "baselines/compressed_color.h"
#include "memory/lru_cache.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/support/tests.h"

namespace tessera::baselines::packed_codes_test {
namespace {

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

// ---- Places -----------------------------------------------------------------------------------------------------

// Vertices of a block at `address`: its own, or anywhere behind some blocks before it.
std::vector<std::optional<VertexPlace>> random_places(Random& random, std::size_t count, std::uint64_t address) {
  std::vector<std::uint64_t> middles(static_cast<std::size_t>(random.integer(1, 9)));
  for (std::uint64_t& middle : middles)
    middle = address - 4 * static_cast<std::uint64_t>(random.integer(0, random.coin() ? 100 : 250'000'000));
  std::vector<std::optional<VertexPlace>> out(count);
  for (auto& place : out)
    if (random.coin())
      place = VertexPlace{middles[static_cast<std::size_t>(random.integer(0, static_cast<int>(middles.size()) - 1))],
                          static_cast<std::uint8_t>(random.integer(0, 63))};
  out[0] = VertexPlace{middles[0], 63};
  return out;
}

TEST(PlaceCode, EveryPlaceComesBack) {
  Random random(2);
  for (int trial = 0; trial < 400; ++trial) {
    const std::uint64_t address = 16 * static_cast<std::uint64_t>(random.integer(62'500'000, 200'000'000));
    const auto count = static_cast<std::size_t>(random.integer(1, 64));
    const auto places = random_places(random, count, address);
    const std::vector<std::uint8_t> bytes = encode_places(places, address);
    std::size_t taken = 0;
    EXPECT_EQ(decode_places(bytes, count, address, taken), places);
    EXPECT_EQ(taken, bytes.size());
    EXPECT_EQ(test::decode_place_bits(bytes, count, address, taken), places);
    EXPECT_EQ(taken, bytes.size());
  }
}

TEST(PlaceCodeTwin, AnotherPlaceOrBlockIsCaught) {
  std::vector<std::optional<VertexPlace>> places = {VertexPlace{400, 3}, std::nullopt, VertexPlace{96, 0}};
  const std::vector<std::uint8_t> bytes = encode_places(places, 1600);
  std::size_t taken = 0;
  places[0]->place = 4;
  EXPECT_NE(decode_places(bytes, 3, 1600, taken), places);
  places[0] = VertexPlace{404, 3};
  EXPECT_NE(decode_places(bytes, 3, 1600, taken), places);
}

// One block before: a byte for how many, two for how far, then 7 bits for each shared vertex and one for each own.
TEST(PlaceCode, TakesTheBitsOfItsDescription) {
  std::vector<std::optional<VertexPlace>> places(64);
  for (std::size_t v = 0; v < 16; ++v) places[v] = VertexPlace{16, static_cast<std::uint8_t>(v)};
  EXPECT_EQ(encode_places(places, 16 + 4 * 200).size(), 1u + 2 + (16 * 7 + 48) / 8);
  // Two blocks before, one of them 10 units behind the other: a byte more, and a bit more for each shared vertex.
  places[3]->middle = 16 + 4 * 10;
  EXPECT_EQ(encode_places(places, 16 + 4 * 200).size(), 1u + 2 + 1 + (16 * 8 + 48) / 8);
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

TEST(CompressedColor, BlendedColorsAreMixed) {
  CompressedColorMemory memory(1 << 20, kBurst, layout());
  const std::vector<std::uint32_t> colors = {0xFF0000FF, 0x8000FF00};
  memory.draw({0, true, false, 0, 1}, std::vector<ColorWrite>{{0x1, 0}}, colors);
  memory.draw({0, true, true, 0, 1}, std::vector<ColorWrite>{{0x1, 1}}, colors);
  EXPECT_EQ(memory.colors()[0] & 255u, 127u);
  EXPECT_EQ(memory.colors()[0] >> 8 & 255u, 128u);
  EXPECT_EQ(memory.colors()[1], 0u);
}

// A naive machine: LRU caches of the lines on chip, and blocks stored as the real encoder compressed them.
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

TEST(CompressedColor, CC1CC2ReadBytesWereWrittenAndDecodeToTheColorsThatLeft) {
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
}  // namespace tessera::baselines::packed_codes_test
