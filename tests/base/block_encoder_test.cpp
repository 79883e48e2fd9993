// Textures as blocks of ETC2 and ASTC.
#include <astcenc.h>
#include <rapidcheck/gtest.h>

#include "base/block_encoder.h"
#include "base/ktx2/etc2_block.h"
#include "base/parallel.h"
#include "tests/support/tests.h"

namespace tessera::block_encoder_test {
namespace {

using ktx2::BasisLevel;
using Bytes = std::vector<std::uint8_t>;

constexpr BlockFormat kFormats[] = {BlockFormat::kEtc2,     BlockFormat::kAstc4x4, BlockFormat::kAstc5x5,
                                    BlockFormat::kAstc6x6,  BlockFormat::kAstc8x8, BlockFormat::kAstc10x10,
                                    BlockFormat::kAstc12x12};

enum class Content { kSolid, kGradient, kNoise };

BasisLevel level_of(int width, int height, Content content, bool alpha, unsigned seed = 1) {
  BasisLevel level{width, height, {}, {}};
  std::uint32_t state = seed;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 4; ++c) {
        state = state * 1664525u + 1013904223u;
        int value = 40 + 50 * c;
        if (content == Content::kGradient) value = (c * 60 + 3 * x + (c % 2 == 0 ? 2 : -1) * y + 256) % 512;
        if (content == Content::kGradient && value > 255) value = 511 - value;
        if (content == Content::kNoise) value = static_cast<int>(state >> 24);
        level.texels.push_back(static_cast<std::uint8_t>(c == 3 && !alpha ? 255 : value));
      }
  return level;
}

// Mean over the channels that count.
double psnr_of(const Bytes& a, const Bytes& b, bool alpha) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (i % 4 == 3 && !alpha) continue;
    const double difference = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sum += difference * difference, count += 1;
  }
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * count / sum);
}

// Decodes the blocks with libastcenc, whose decoder is independent.
Bytes by_libastcenc(const BasisLevel& level, int side, bool srgb, const Bytes& blocks) {
  astcenc_config config{};
  EXPECT_EQ(
      astcenc_config_init(srgb ? ASTCENC_PRF_LDR_SRGB : ASTCENC_PRF_LDR, static_cast<unsigned>(side),
                          static_cast<unsigned>(side), 1, ASTCENC_PRE_FASTEST, ASTCENC_FLG_DECOMPRESS_ONLY, &config),
      ASTCENC_SUCCESS);
  astcenc_context* context = nullptr;
  EXPECT_EQ(astcenc_context_alloc(&config, 1, &context), ASTCENC_SUCCESS);
  const std::unique_ptr<astcenc_context, decltype(&astcenc_context_free)> guard(context, astcenc_context_free);
  Bytes texels(level.texels.size());
  void* rows[] = {texels.data()};
  astcenc_image image{static_cast<unsigned>(level.width), static_cast<unsigned>(level.height), 1, ASTCENC_TYPE_U8,
                      rows};
  const astcenc_swizzle swizzle{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_A};
  EXPECT_EQ(astcenc_decompress_image(context, blocks.data(), blocks.size(), &image, &swizzle, 0), ASTCENC_SUCCESS);
  return texels;
}

Bytes by_etc2_blocks(const BasisLevel& level, std::size_t block_bytes, const Bytes& blocks) {
  Bytes texels(level.texels.size());
  const int across = (level.width + 3) / 4;
  for (int y = 0; y < level.height; ++y)
    for (int x = 0; x < level.width; ++x) {
      const std::uint8_t* bytes = &blocks[static_cast<std::size_t>(y / 4 * across + x / 4) * block_bytes];
      ktx2::TexelBlock block;
      block.fill({0, 0, 0, 255});
      if (block_bytes == 16) ktx2::decode_eac_alpha(std::span<const std::uint8_t, 8>(bytes, 8), block);
      ktx2::decode_etc2_rgb(std::span<const std::uint8_t, 8>(bytes + block_bytes - 8, 8), block);
      std::copy_n(block[static_cast<std::size_t>(y % 4 * 4 + x % 4)].begin(), 4,
                  &texels[static_cast<std::size_t>(4 * (y * level.width + x))]);
    }
  return texels;
}

Bytes decoded(BlockFormat format, bool srgb, bool alpha, const BasisLevel& level, const Bytes& blocks) {
  if (format == BlockFormat::kEtc2)
    return by_etc2_blocks(level, static_cast<std::size_t>(block_bytes(format, alpha)), blocks);
  return by_libastcenc(level, block_side(format), srgb, blocks);
}

// BE1, BE3. The twins: with each block at the address of the next one, or by the other transfer function.
TEST(BlockEncoder, TexelsEqualTheDecodedBlocks) {
  for (const BlockFormat format : kFormats) {
    int others = 0;
    for (const bool srgb : {false, true}) {
      BlockEncoder encoder(format, srgb);
      for (const bool alpha : {false, true})
        for (const auto& [width, height] : {std::pair{37, 29}, {24, 24}, {3, 1}, {1, 1}}) {
          BasisLevel level = level_of(width, height, Content::kGradient, alpha);
          encoder.encode(alpha, level);
          const int side = block_side(format);
          ASSERT_EQ(level.blocks.size(),
                    static_cast<std::size_t>((width + side - 1) / side * ((height + side - 1) / side)) *
                        static_cast<std::size_t>(block_bytes(format, alpha)));
          EXPECT_EQ(level.texels, decoded(format, srgb, alpha, level, level.blocks)) << word(format) << " " << width;
          if (!alpha) {
            for (std::size_t i = 3; i < level.texels.size(); i += 4) ASSERT_EQ(level.texels[i], 255);
          }
          if (width < 24) continue;
          Bytes shifted = level.blocks;
          std::rotate(shifted.begin(), shifted.begin() + block_bytes(format, alpha), shifted.end());
          EXPECT_NE(level.texels, decoded(format, srgb, alpha, level, shifted)) << word(format);
          others += level.texels != decoded(format, !srgb, alpha, level, level.blocks) ? 1 : 0;
        }
    }
    EXPECT_EQ(others > 0, format != BlockFormat::kEtc2) << word(format);
  }
}

// BE2
TEST(BlockEncoder, AnyNumberOfThreadsMakesTheSameBlocks) {
  for (const BlockFormat format : {BlockFormat::kEtc2, BlockFormat::kAstc5x5, BlockFormat::kAstc12x12}) {
    BasisLevel wanted;
    for (const std::size_t threads : {1u, 2u, 7u}) {
      const ThreadLimit limit(threads);
      BasisLevel level = level_of(61, 47, Content::kNoise, true);
      BlockEncoder(format, true).encode(true, level);
      if (threads == 1) wanted = level;
      EXPECT_EQ(level.blocks, wanted.blocks) << word(format) << " " << threads;
      EXPECT_EQ(level.texels, wanted.texels) << word(format) << " " << threads;
    }
  }
}

// An encoder that was used before leaves no trace.
RC_GTEST_PROP(BlockEncoderProperty, EachLevelIsEncodedAlone, (std::uint32_t seed)) {
  const BlockFormat format = kFormats[seed % std::size(kFormats)];
  const int width = 1 + static_cast<int>(seed / 7 % 30), height = 1 + static_cast<int>(seed / 210 % 30);
  const bool alpha = seed % 2 == 0;
  BasisLevel before = level_of(20, 20, Content::kNoise, true, seed + 1),
             after = level_of(width, height, Content::kNoise, alpha, seed), alone = after;
  BlockEncoder both(format, false);
  both.encode(true, before);
  both.encode(alpha, after);
  BlockEncoder(format, false).encode(alpha, alone);
  RC_ASSERT(after.blocks == alone.blocks);
  RC_ASSERT(after.texels == alone.texels);
}

// Two smooth channels that have nothing to do with each other, as roughness and metalness: the fast search, which is enough
// for colours, leaves 36.8 dB.
TEST(BlockEncoder, ChannelsOfTheirOwnAreSearchedThoroughly) {
  BasisLevel level = level_of(128, 128, Content::kGradient, false);
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const auto byte = [](float value) { return static_cast<std::uint8_t>(value); };
      std::uint8_t* texel = &level.texels[static_cast<std::size_t>(4 * (128 * y + x))];
      texel[0] = byte(127 + 100 * std::sin(fx * 0.2f));
      texel[1] = byte(127 + 100 * std::sin(fy * 0.33f + fx * 0.1f));
      texel[2] = 100;
    }
  const auto decibels = [&](bool srgb) {
    BasisLevel coded = level;
    BlockEncoder(BlockFormat::kAstc4x4, srgb).encode(false, coded);
    double sum = 0;
    for (std::size_t k = 0; k < level.texels.size(); ++k) {
      const double d = static_cast<double>(coded.texels[k]) - static_cast<double>(level.texels[k]);
      sum += d * d;
    }
    return 10 * std::log10(255.0 * 255.0 * 3 * 128 * 128 / sum);
  };
  EXPECT_GT(decibels(false), 46.5);
  EXPECT_LT(decibels(true), 40);
}

TEST(BlockEncoder, KeepsTheQualityThatItsBitsAllow) {
  // Least PSNR in decibels: the measured value less one.
  struct Floor {
    BlockFormat format;
    double gradient, noise;
  };
  const Floor floors[] = {{BlockFormat::kEtc2, 48, 13.7},       {BlockFormat::kAstc4x4, 42.7, 14.6},
                          {BlockFormat::kAstc5x5, 40.4, 13.1},  {BlockFormat::kAstc6x6, 38.6, 12},
                          {BlockFormat::kAstc8x8, 34.3, 11.1},  {BlockFormat::kAstc10x10, 32.8, 10.5},
                          {BlockFormat::kAstc12x12, 31.1, 10.2}};
  for (const Floor& floor : floors)
    for (const bool alpha : {false, true}) {
      BlockEncoder encoder(floor.format, true);
      const auto error = [&](Content content) {
        const BasisLevel stored = level_of(48, 48, content, alpha);
        BasisLevel level = stored;
        encoder.encode(alpha, level);
        return psnr_of(stored.texels, level.texels, alpha);
      };
      EXPECT_GE(error(Content::kSolid), floor.format == BlockFormat::kEtc2 ? 51 : 99) << word(floor.format);
      EXPECT_GE(error(Content::kGradient), floor.gradient) << word(floor.format) << alpha;
      EXPECT_GE(error(Content::kNoise), floor.noise) << word(floor.format) << alpha;
    }
}

}  // namespace
}  // namespace tessera::block_encoder_test
