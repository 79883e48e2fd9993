// Maps of depths: lookups give the stored depth, within half a step of the format; and tiles without casters.
#include "tilecore/shading/depth_maps.h"
#include "tests/support/tests.h"
#include "tilecore/shading/texture_unit.h"

namespace tessera::tilecore::depth_maps_test {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

TEST(DepthMaps, MAP1LookupsAreWithinHalfAStepOfTheStoredDepth) {
  test::Random random(7);
  for (const scene::DepthFormat format :
       {scene::DepthFormat::kD16, scene::DepthFormat::kD24, scene::DepthFormat::kD32F}) {
    DepthMaps maps(48, 2, format, 32, 16);
    maps.begin(1, 10, 210);
    const IntRect tile{32, 16, 48, 32};
    std::vector<float> depths;
    for (int k = 0; k < 16 * 16; ++k) depths.push_back(random.uniform(10, 210));
    EXPECT_TRUE(maps.store(1, tile, depths));
    // Single precision holds a depth of 200 to 2^-17.
    const double most = 0.5 * maps.step(1) + (format == scene::DepthFormat::kD32F ? 0.0 : 0x1p-17);
    for (int y = 16; y < 32; ++y)
      for (int x = 32; x < 48; ++x)
        EXPECT_LE(std::abs(static_cast<double>(maps.texel(1, x, y)) -
                           static_cast<double>(depths[static_cast<std::size_t>((y - 16) * 16 + x - 32)])),
                  most);
    EXPECT_EQ(maps.texel(0, 40, 20), kNothing) << "the other layer";
  }
}

TEST(DepthMaps, MAP2ATileInWhichNothingCastsReadsAsNothing) {
  DepthMaps maps(64, 1, scene::DepthFormat::kD32F, 32, 32);
  maps.begin(0, 0, 1);
  const IntRect tile{0, 32, 32, 64};
  std::vector<float> depths(32 * 32, 0.5f);
  EXPECT_TRUE(maps.store(0, tile, depths));
  EXPECT_EQ(maps.cleared(), (std::vector<std::uint8_t>{1, 1, 0, 1}));
  depths.assign(32 * 32, kNothing);
  EXPECT_FALSE(maps.store(0, tile, depths));
  EXPECT_EQ(maps.cleared(), (std::vector<std::uint8_t>{1, 1, 1, 1}));
  EXPECT_EQ(maps.texel(0, 5, 40), kNothing);
  EXPECT_EQ(maps.flag_bytes(), 1u);
}

// A lookup reads the flags of its tile; lines of a tile that is cleared it does not read.
TEST(DepthMaps, ALookupOfAClearedTileReadsItsFlagAlone) {
  std::vector<DepthMaps> maps;
  maps.emplace_back(64, 2, scene::DepthFormat::kD32F, 32, 32);
  const TextureMemory memory({}, 64, {}, maps);
  const TextureLayoutView& layout = memory.layout(maps[0]);
  EXPECT_EQ(memory.lines(), 2u * 64 * 64 * 4 / 64 + 1) << "texels, and a line of flags";
  std::vector<float> depths(32 * 32, 0.5f);
  maps[0].begin(1, 0, 1);
  maps[0].store(1, {32, 0, 64, 32}, depths);
  TextureUnit unit;
  unit.begin_tile({.memory = &memory});
  const auto misses = [&](int layer, int x, int y) {
    const std::int32_t line = layout.first_line[layer] + y / 4 * layout.lines_across[layer] + x / 4;
    std::array<std::vector<std::int32_t>, 4> lanes;
    std::array<std::int32_t*, 4> lines{};
    for (std::size_t k = 0; k < 4; ++k) lanes[k].assign(32, k == 0 ? line : -1), lines[k] = lanes[k].data();
    unit.begin_tile({.memory = &memory});
    unit.fetch_depths(layout, lines, 0, 8, 1);
    return unit.take_misses();
  };
  const auto flags = static_cast<std::uint32_t>(layout.first_flag);
  EXPECT_EQ(misses(0, 40, 8), (std::vector<std::uint32_t>{flags}));
  EXPECT_EQ(misses(1, 8, 8), (std::vector<std::uint32_t>{flags}));
  EXPECT_EQ(misses(1, 40, 8),
            (std::vector<std::uint32_t>{flags, static_cast<std::uint32_t>(layout.first_line[1] + 2 * 16 + 10)}));
}

}  // namespace
}  // namespace tessera::tilecore::depth_maps_test
