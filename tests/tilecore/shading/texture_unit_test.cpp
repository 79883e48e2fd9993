// Lines of the emulated memory that lookups in textures need.
#include "tilecore/shading/texture_unit.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::texture_unit_test {
namespace {

using shaders::MipFilter;
using shaders::Sampler;
using shaders::Texture;
using shaders::Wrap;

std::shared_ptr<const Texture> black(int width, int height, int white_x = -1, int white_y = -1) {
  Image8 image(width, height, 4);
  if (white_x >= 0) image.at(white_x, white_y)[0] = 255;
  return std::make_shared<const Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
}

scene::Capture with_texture(std::shared_ptr<const Texture> texture) {
  scene::Capture capture;
  scene::Material material;
  material.base_color_texture.texture = std::move(texture);
  test::add_material(capture, material);
  return capture;
}

// Lines of one lookup with a cache that is empty.
std::set<std::uint32_t> lines_of(const TextureMemory& memory, std::int64_t line_bytes, const Texture& texture,
                                 const Sampler& sampler, Vec2 uv, float lod, TextureCounters* counters = nullptr) {
  TextureUnit unit;
  unit.begin_tile({&memory, 1 << 16, 4, line_bytes});
  shaders::TexelFootprint footprint;
  texture.sample(sampler, uv, lod, &footprint);
  unit.fetch(texture, footprint);
  const std::vector<std::uint32_t> lines = unit.take_misses();
  const std::set<std::uint32_t> distinct(lines.begin(), lines.end());
  EXPECT_EQ(distinct.size(), lines.size()) << "a line was asked for twice";
  if (counters != nullptr) *counters = unit.take_counters();
  return distinct;
}

// Invariant TX1, from the outside: a texel whose colour changes a lookup's result lies in a line that the lookup
// asked for.
TEST(TextureUnit, ALookUpAsksForTheLinesOfAllTexelsThatItDependsOn) {
  test::Random random(17);
  constexpr int kSize = 8;
  for (const std::int64_t line_bytes : {16, 32, 64, 128}) {
    const auto dark = black(kSize, kSize);
    const scene::Capture capture = with_texture(dark);
    const TextureMemory memory(capture.materials, line_bytes);
    const int w = memory.layout(dark.get()).width.texels, h = memory.layout(dark.get()).height.texels;
    EXPECT_EQ(w * h * 4, line_bytes);
    for (int round = 0; round < 40; ++round) {
      Sampler sampler;
      sampler.wrap_s = static_cast<Wrap>(random.integer(0, 2));
      sampler.wrap_t = static_cast<Wrap>(random.integer(0, 2));
      sampler.magnify_linear = random.coin();
      const Vec2 uv(random.uniform(-2, 3), random.uniform(-2, 3));
      const std::set<std::uint32_t> lines = lines_of(memory, line_bytes, *dark, sampler, uv, 0);
      EXPECT_LE(lines.size(), 4u);
      std::set<std::uint32_t> needed;
      for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
          if (black(kSize, kSize, x, y)->sample(sampler, uv, 0).x > 0)
            needed.insert(static_cast<std::uint32_t>(y / h * (kSize / w) + x / w));
      for (const std::uint32_t line : needed) EXPECT_TRUE(lines.contains(line)) << "seed 17, round " << round;
    }
  }
}

TEST(TextureUnit, ATrilinearLookUpIsTwoAndEachLevelHasLinesOfItsOwn) {
  const auto texture = black(64, 32);
  const scene::Capture capture = with_texture(texture);
  const TextureMemory memory(capture.materials, 64);
  // 16x8 blocks, 8x4, 4x2, 2x1, then three levels of one.
  EXPECT_EQ(memory.lines(), 128u + 32 + 8 + 2 + 1 + 1 + 1);
  TextureCounters counters;
  const std::set<std::uint32_t> both = lines_of(memory, 64, *texture, {}, Vec2(0.3f, 0.3f), 1.5f, &counters);
  EXPECT_EQ(counters.texels, 2u);
  EXPECT_GE(*both.begin(), 128u);
  EXPECT_LT(*both.begin(), 128u + 32);
  EXPECT_GE(*both.rbegin(), 128u + 32);
  lines_of(memory, 64, *texture, {}, Vec2(0.3f, 0.3f), 2.0f, &counters);
  EXPECT_EQ(counters.texels, 1u);
  Sampler nearest;
  nearest.minify_linear = false;
  nearest.mip = MipFilter::kNearest;
  EXPECT_EQ(lines_of(memory, 64, *texture, nearest, Vec2(0.3f, 0.3f), 1.5f, &counters).size(), 1u);
  EXPECT_EQ(counters.texels, 1u);
}

// Invariant TX1: of lines far apart, too, in the order in which they were met.
TEST(TextureUnit, AWarpAsksForEachLineOnceWhicheverLanesNameIt) {
  const auto texture = black(64, 64);
  const scene::Capture capture = with_texture(texture);
  const TextureMemory memory(capture.materials, 64);
  test::Random random(23);
  TextureUnit unit;
  for (int round = 0; round < 300; ++round) {
    constexpr std::size_t kLanes = 32;
    std::array<std::array<std::int32_t, kLanes + 16>, 8> lines;
    std::uint64_t texels = 0, requests = 0;
    // Multiples of a power of two collide wherever places are found by the lowest bits.
    const int step = 1 << random.integer(0, 12), range = random.integer(1, 40);
    for (std::size_t l = 0; l < 8; ++l) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::int32_t line = random.integer(0, 4) == 0 ? -1 : step * random.integer(0, range);
        lines[l][lane] = line;
        if (l % 4 == 0 && line >= 0) ++texels;
      }
    }
    std::vector<std::uint32_t> expected;
    for (std::size_t level = 0; level < 2; ++level) {
      const auto& first = lines[4 * level];
      if (std::all_of(first.begin(), first.begin() + kLanes, [](std::int32_t line) { return line < 0; })) continue;
      std::vector<std::int32_t> asked;
      for (std::size_t corner = 0; corner < 4; ++corner)
        for (std::size_t lane = 0; lane < kLanes; ++lane)
          if (const std::int32_t line = lines[4 * level + corner][lane];
              line >= 0 && std::find(asked.begin(), asked.end(), line) == asked.end())
            asked.push_back(line);
      requests += asked.size();
      // The cache is large enough for all of them.
      for (const std::int32_t line : asked)
        if (std::find(expected.begin(), expected.end(), static_cast<std::uint32_t>(line)) == expected.end())
          expected.push_back(static_cast<std::uint32_t>(line));
    }
    unit.begin_tile({&memory, 1 << 16, 1 << 10, 64});
    std::array<std::int32_t*, 8> pointers;
    for (std::size_t l = 0; l < 8; ++l) pointers[l] = lines[l].data();
    TextureLayoutView layout{};
    layout.compressed = round % 2 == 1;
    unit.fetch_warp(layout, pointers, 0, kLanes);
    EXPECT_EQ(unit.take_misses(), expected) << "round " << round;
    const TextureCounters counters = unit.take_counters();
    EXPECT_EQ(counters.cache_requests, requests);
    EXPECT_EQ(counters.texels, texels);
    EXPECT_EQ(counters.texels_decoded, layout.compressed ? texels : 0);
  }
}

// Invariant TX2.
TEST(TextureUnit, EveryTileFindsTheCacheEmpty) {
  const auto texture = black(64, 64);
  const scene::Capture capture = with_texture(texture);
  const TextureMemory memory(capture.materials, 64);
  TextureUnit unit;
  const auto tile = [&](bool begin) {
    if (begin) unit.begin_tile({&memory, 1 << 14, 4, 64});
    shaders::TexelFootprint footprint;
    for (int i = 0; i < 64; ++i) {
      texture->sample({}, Vec2(static_cast<float>(i) / 64, 0.5f), 0, &footprint);
      unit.fetch(*texture, footprint);
    }
    return unit.take_misses();
  };
  const std::vector<std::uint32_t> first = tile(true);
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(tile(true), first);
  EXPECT_TRUE(tile(false).empty());  // the cache holds them all
}

TEST(TextureMemory, TexturesOfACaptureLieBehindEachOtherAndSharedOnesLieOnce) {
  const auto a = black(16, 16), b = black(8, 8);
  scene::Capture capture = with_texture(a);
  scene::Material second;
  second.base_color_texture.texture = a;
  second.normal_texture.texture = b;
  test::add_material(capture, second);
  const TextureMemory memory(capture.materials, 64);
  const std::uint32_t lines_a = 16 + 4 + 1 + 1 + 1;
  EXPECT_EQ(memory.layout(a.get()).first_line[0], 0);
  EXPECT_EQ(memory.layout(b.get()).first_line[0], static_cast<std::int32_t>(lines_a));
  EXPECT_EQ(memory.lines(), lines_a + 4u + 1 + 1 + 1);
}

// ---- Textures of blocks -----------------------------------------------------------------------------------------

std::shared_ptr<const Texture> in_blocks(int width, int height, shaders::TexelBlocks blocks, int levels = 0) {
  std::vector<Texture::Level> all;
  for (int level = 0; level < std::max(1, levels); ++level) {
    const int w = std::max(1, width >> level), h = std::max(1, height >> level);
    all.push_back({w, h, std::vector<std::uint8_t>(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4)});
  }
  return std::make_shared<const Texture>(std::move(all), shaders::ColorSpace::kLinear, blocks);
}

constexpr shaders::TexelBlocks kRgba8{1, 4}, kEtc2Rgb{4, 8}, kAstc{4, 16};
// Every size that a texture's blocks may have.
constexpr shaders::TexelBlocks kAllBlocks[] = {kRgba8, kEtc2Rgb, kAstc, {5, 16}, {6, 16}, {8, 16}, {10, 16}, {12, 16}};

// Which line along an axis a texel lies in, by division: for all texels that an image may have, and the lines of all
// sizes.
int first_wrong_line(const LineSide& side) {
  for (int texel = 0; texel < 1 << 15; ++texel)
    if (side.line_of(texel) != texel / side.texels) return texel;
  return -1;
}
TEST(TextureMemory, LinesOfTexelsAreQuotients) {
  for (const shaders::TexelBlocks blocks : kAllBlocks)
    for (int across = 1; across <= 64; across *= 2)
      EXPECT_EQ(first_wrong_line(line_side(blocks.side * across)), -1) << blocks.side << " * " << across;
  LineSide wrong = line_side(12);
  --wrong.multiplier;
  EXPECT_EQ(first_wrong_line(wrong), 12);
}

// Invariants TX3 and TX4: lines = blocks * bytes / line, rounded up to whole lines along both axes.
TEST(TextureMemory, ALevelTakesTheLinesOfItsBlocks) {
  for (const std::int64_t line_bytes : {16, 32, 64, 128, 256})
    for (const shaders::TexelBlocks blocks : kAllBlocks)
      for (const auto& [width, height] : {std::pair{256, 128}, {64, 64}, {20, 12}, {7, 5}, {1, 1}}) {
        const auto texture = in_blocks(width, height, blocks, 1);
        const TextureMemory memory(with_texture(texture).materials, line_bytes);
        const TextureLayoutView& base = memory.layout(texture.get());
        const std::uint64_t per_line = static_cast<std::uint64_t>(line_bytes / blocks.bytes);
        EXPECT_EQ(static_cast<unsigned>(base.width.texels * base.height.texels),
                  per_line * static_cast<unsigned>(blocks.side * blocks.side));
        EXPECT_TRUE(base.width.texels == base.height.texels || base.width.texels == 2 * base.height.texels);
        const auto lines = [](int texels, const LineSide& side) {
          return static_cast<std::uint64_t>((texels + side.texels - 1) / side.texels);
        };
        const std::uint64_t own =
            texture->level_count() > 1 ? static_cast<std::uint64_t>(base.first_line[1]) : memory.lines();
        EXPECT_EQ(own, lines(width, base.width) * lines(height, base.height));
        if (width % base.width.texels != 0 || height % base.height.texels != 0) continue;  // no whole lines
        EXPECT_EQ(own * per_line,
                  static_cast<std::uint64_t>(width / blocks.side) * static_cast<unsigned>(height / blocks.side))
            << line_bytes << " " << blocks.bytes;
      }
}

// Seen 1:1, every texel looked up once: (w/4)(h/4) blocks, each line once.
std::uint64_t misses_one_to_one(const Texture& texture, std::int64_t line_bytes) {
  scene::Material material;
  material.base_color_texture.texture = {std::shared_ptr<const Texture>(), &texture};
  const TextureMemory memory(std::span(&material, 1), line_bytes);
  TextureUnit unit;
  unit.begin_tile({&memory, 1 << 20, 16, line_bytes});
  Sampler nearest;
  nearest.magnify_linear = false;
  for (int y = 0; y < texture.height(); ++y)
    for (int x = 0; x < texture.width(); ++x) {
      shaders::TexelFootprint footprint;
      texture.sample(nearest,
                     Vec2((static_cast<float>(x) + 0.5f) / static_cast<float>(texture.width()),
                          (static_cast<float>(y) + 0.5f) / static_cast<float>(texture.height())),
                     0, &footprint);
      unit.fetch(texture, footprint);
    }
  return unit.take_counters().cache_misses;
}

TEST(TextureUnit, ATextureSeenOneToOneTakesTheBytesOfItsBlocks) {
  for (const std::int64_t line_bytes : {16, 64, 128}) {
    const std::uint64_t blocks = (64 / 4) * (32 / 4), line = static_cast<std::uint64_t>(line_bytes);
    EXPECT_EQ(misses_one_to_one(*in_blocks(64, 32, kAstc), line_bytes), blocks * 16 / line);
    EXPECT_EQ(misses_one_to_one(*in_blocks(64, 32, kEtc2Rgb), line_bytes), blocks * 8 / line);
    EXPECT_EQ(misses_one_to_one(*in_blocks(64, 32, kRgba8), line_bytes), blocks * 64 / line);
    // Sides of lines divide 240 and 120.
    for (const int side : {5, 6, 10, 12})
      EXPECT_EQ(misses_one_to_one(*in_blocks(240, 120, {side, 16}), line_bytes),
                static_cast<std::uint64_t>(240 / side * (120 / side)) * 16 / line)
          << side;
  }
}

// The twin: texels that were taken for plain ones would cost four times the lines.
TEST(TextureUnit, BlocksTakenForPlainTexelsAreCaught) {
  EXPECT_NE(misses_one_to_one(*in_blocks(64, 32, kAstc), 64), misses_one_to_one(*in_blocks(64, 32, kRgba8), 64));
}

}  // namespace
}  // namespace tessera::tilecore::texture_unit_test
