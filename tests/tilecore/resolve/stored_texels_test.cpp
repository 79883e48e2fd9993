// Texels that passes store beside colours (tilecore/resolve/stored_texels.h): blocks of integers and small floats keep
// their bits, depths and samples that are alike take little, and signatures see every change.
#include "tilecore/resolve/stored_texels.h"
#include "tests/support/tests.h"
#include "tilecore/shading/gbuffer_texels.h"

namespace tessera::tilecore::stored_texels_test {
namespace {

constexpr TexelCoding kBoth{64, true, true};

std::vector<BlockShape> all_shapes() {
  std::vector<BlockShape> all{kWordBlock, kShortBlock, kTwoHalvesBlock, kSmallFloatsBlock};
  for (const GbufferLayout layout : {GbufferLayout::kExact, GbufferLayout::kPacked}) {
    ShadingSettings settings;
    settings.layout = layout;
    const TexelFormat format = gbuffer_format(settings, 1);
    all.insert(all.end(), format.planes.begin(), format.planes.end());
  }
  return all;
}

PixelCode random_code(test::Random& random, const ChannelBits& bits, int max_bits) {
  PixelCode code{};
  for (std::size_t c = 0; c < code.size(); ++c)
    code[c] = static_cast<std::uint16_t>(random.integer(0, (1 << std::min<int>(bits[c], max_bits)) - 1));
  return code;
}

// FC1 to FC3 of frame_compression.h for channels of 0 to 16 bits that are no half floats.
TEST(StoredTexels, BlocksOfEveryPlaneKeepTheirBits) {
  test::Random random(7);
  for (const BlockShape& shape : all_shapes())
    for (int trial = 0; trial < 60; ++trial) {
      std::vector<std::uint16_t> codes;
      const PixelCode base = random_code(random, shape.bits, 16);
      for (std::size_t i = 0; i < shape.pixels(); ++i) {
        const PixelCode code = random_code(random, shape.bits, trial % 18);
        for (std::size_t c = 0; c < 4; ++c)
          codes.push_back(static_cast<std::uint16_t>((base[c] + code[c]) & ((1u << shape.bits[c]) - 1)));
      }
      const CompressedBlock block = compress_block(codes, shape, 32);
      std::vector<std::uint16_t> back(codes.size(), 0xdead);
      decompress_block(block, shape, back);
      EXPECT_EQ(back, codes);
      EXPECT_LE(block.payload_bytes, shape.raw_bytes());
      EXPECT_EQ(compressed_block_bytes(codes, shape, 32), block.payload_bytes);
    }
}

StoredTexels depths_of(const std::vector<float>& depths, IntRect texels, int samples, const TexelCoding& how = kBoth) {
  const TexelFormat format = depth_format(4, samples);
  TexelEncoder encoder(format, how, texels);
  encoder.add_plane([&](int sample, std::size_t texel) {
    return depth_code(depths[texel * static_cast<std::size_t>(samples) + static_cast<std::size_t>(sample)], true);
  });
  return encoder.take();
}
std::uint64_t sum(const std::vector<std::uint16_t>& bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
}

TEST(StoredTexels, ADepthThatClearsTakesNoPayload) {  // STX1
  const float nothing = std::numeric_limits<float>::infinity();
  EXPECT_EQ(depth_code(nothing, true), PixelCode{});
  EXPECT_EQ(depth_code(nothing, false), PixelCode{});
  std::vector<float> depths(std::size_t{16 * 16 * 4}, nothing);
  EXPECT_EQ(depths_of(depths, {0, 0, 16, 16}, 4).block_bytes, std::vector<std::uint16_t>(16, 0));
  depths[0] = 3;  // one sample of one pixel
  EXPECT_GT(sum(depths_of(depths, {0, 0, 16, 16}, 4).block_bytes), 0u);
}

// Depths keep their order, so neighbours differ by little: nearer is larger.
TEST(StoredTexels, DepthsKeepTheirOrder) {
  const std::array<float, 7> depths{
      0.0f, 1e-30f, 0.1f, 1.0f, std::nextafter(1.0f, 2.0f), 1e30f, std::numeric_limits<float>::infinity()};
  for (std::size_t i = 1; i < depths.size(); ++i) EXPECT_LT(depth_bits(depths[i]), depth_bits(depths[i - 1]));
  EXPECT_EQ(depth_bits(depths[3]) - depth_bits(depths[4]), 1u);
}

// A plane whose depths are equally spaced floats has residuals of 0 behind the first row and column.
TEST(StoredTexels, APlaneOfDepthsTakesFewBursts) {
  std::vector<float> plane, noise;
  test::Random random(3);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      plane.push_back(1.25f + static_cast<float>(3 * x + 5 * y) / 4096);
      noise.push_back(random.uniform(1, 1000));
    }
  EXPECT_LE(sum(depths_of(plane, {0, 0, 16, 16}, 1).block_bytes), 4u * 128u);
  EXPECT_EQ(sum(depths_of(noise, {0, 0, 16, 16}, 1).block_bytes), 4u * 256u);  // STX3: as raw
}

TEST(StoredTexels, SamplesThatAreAlikeTakeThePayloadOfOne) {  // STX2
  test::Random random(5);
  for (int samples : {1, 2, 4}) {
    std::vector<float> depths;
    for (int texel = 0; texel < 16 * 16; ++texel)
      depths.insert(depths.end(), static_cast<std::size_t>(samples), random.uniform(1, 1000));
    const auto bytes = [&] { return sum(depths_of(depths, {0, 0, 16, 16}, samples).block_bytes); };
    EXPECT_EQ(bytes(), 4u * 256u) << samples;
    if (samples == 1) continue;
    depths[1] += 1;  // the second sample of the first pixel
    EXPECT_EQ(bytes(), 4u * 256u + 64u);
  }
}

// Blocks lie on the grid of the image; a rectangle that cuts them takes all that it touches.
TEST(StoredTexels, BlocksAreCountedOnTheGridOfTheImage) {
  const TexelFormat one = depth_format(4, 1), four = depth_format(2, 4);
  struct Case {
    IntRect rect;
    std::uint64_t blocks;
  };
  for (const auto& [rect, blocks] :
       {Case{{0, 0, 16, 16}, 4}, {{7, 7, 9, 9}, 4}, {{8, 8, 9, 9}, 1}, {{3, 3, 3, 9}, 0}}) {
    EXPECT_EQ(one.block_count(rect), blocks);
    EXPECT_EQ(one.block_bytes(rect), 256 * blocks);
    EXPECT_EQ(four.block_count(rect), 4 * blocks);
    EXPECT_EQ(four.block_bytes(rect), 4 * 128 * blocks);
  }
  EXPECT_EQ(one.texel_bytes(), 4u);
  EXPECT_EQ(four.texel_bytes(), 8u);
  EXPECT_EQ(depths_of({5, 5, 5, 5}, {7, 7, 9, 9}, 1).block_bytes, std::vector<std::uint16_t>(4, 64));
}

// A burst of 256 bytes holds no block of 128: such planes stay raw, and so do planes of which nothing is known.
TEST(StoredTexels, PlanesThatCannotBeCompressedStayRaw) {
  const IntRect rect{0, 0, 8, 8};
  const TexelFormat shorts = depth_format(2, 1);
  TexelEncoder encoder(shorts, {256, true, false}, rect);
  encoder.add_plane([](int, std::size_t) { return PixelCode{}; });
  EXPECT_EQ(encoder.take().block_bytes, std::vector<std::uint16_t>{128});
  ShadingSettings wide;
  wide.layout = GbufferLayout::kPacked, wide.gbuffer_bits = 192;
  const TexelFormat format = gbuffer_format(wide, 1);
  EXPECT_EQ(format.texel_bytes(), 24u);
  TexelEncoder gbuffer(format, kBoth, rect);
  for (std::size_t plane = 0; plane < 4; ++plane) gbuffer.add_plane([](int, std::size_t) { return PixelCode{}; });
  EXPECT_EQ(gbuffer.take().block_bytes, (std::vector<std::uint16_t>{0, 0, 0, 0, 256, 256}));
  wide.gbuffer_bits = 96;
  EXPECT_EQ(gbuffer_format(wide, 4).texel_bytes(), 4u * 12u);
  wide.layout = GbufferLayout::kExact;
  EXPECT_EQ(gbuffer_format(wide, 4).texel_bytes(), 4u * 64u);
}

TEST(StoredTexels, ASignatureSeesEverySample) {
  test::Random random(9);
  std::vector<float> depths;
  for (int i = 0; i < 9 * 5 * 4; ++i) depths.push_back(random.uniform(1, 100));
  const IntRect rect{3, 2, 12, 7};
  for (const TexelCoding& how : {kBoth, TexelCoding{64, false, true}}) {
    const StoredTexels before = depths_of(depths, rect, 4, how);
    EXPECT_EQ(before.signed_bytes, 9u * 5u * 16u);
    EXPECT_EQ(depths_of(depths, rect, 4, how).signature, before.signature);
    EXPECT_EQ(depths_of(depths, rect, 4, how).check, before.check);
    for (std::size_t i = 0; i < depths.size(); i += 7) {
      std::vector<float> changed = depths;
      changed[i] = std::nextafter(changed[i], 0.0f);
      EXPECT_NE(depths_of(changed, rect, 4, how).signature, before.signature) << i;
      EXPECT_NE(depths_of(changed, rect, 4, how).check, before.check) << i;
    }
  }
  EXPECT_EQ(depths_of(depths, rect, 4, {64, true, false}).signed_bytes, 0u);
}

}  // namespace
}  // namespace tessera::tilecore::stored_texels_test
