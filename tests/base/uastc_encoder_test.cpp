// KTX2 files that are written here, read back.
#include "base/ktx2/uastc_encoder.h"
#include "base/ktx2/etc2_block.h"
#include "base/ktx2/ktx2.h"
#include "base/ktx2/ktx2_writer.h"
#include "base/ktx2/uastc_modes.h"
#include "tests/support/tests.h"

namespace tessera::ktx2::uastc_encoder_test {
namespace {

TexelBlock decoded(const AstcBytes& bytes) {
  AstcBlock block;
  EXPECT_TRUE(read_uastc(bytes, block));
  TexelBlock texels;
  astc_texels(block, false, texels);
  return texels;
}

double squared_error(const TexelBlock& a, const TexelBlock& b) {
  double sum = 0;
  for (std::size_t t = 0; t < 16; ++t)
    for (std::size_t c = 0; c < 4; ++c) sum += std::pow(a[t][c] - b[t][c], 2);
  return sum;
}

// Invariant UE1.
TEST(UastcEncoder, OneColourComesBackExactly) {
  test::Random random(3);
  for (int round = 0; round < 2000; ++round) {
    std::array<std::uint8_t, 4> color;
    for (std::uint8_t& c : color) c = static_cast<std::uint8_t>(random.integer(0, 255));
    TexelBlock texels;
    texels.fill(color);
    EXPECT_EQ(decoded(encode_uastc(texels)), texels);
  }
}

// Invariant UE1: weights of 16 steps between any extremes.
TEST(UastcEncoder, GreysComeBackWithinHalfAStep) {
  test::Random random(4);
  for (int round = 0; round < 500; ++round) {
    TexelBlock texels;
    for (auto& texel : texels) {
      const auto grey = static_cast<std::uint8_t>(random.integer(0, 255));
      texel = {grey, grey, grey, 255};
    }
    const TexelBlock back = decoded(encode_uastc(texels));
    double worst = 0;
    for (std::size_t t = 0; t < 16; ++t)
      worst = std::max(worst, std::abs(static_cast<double>(back[t][0]) - texels[t][0]));
    EXPECT_LE(std::sqrt(squared_error(back, texels) / 48), 8.5 + 1) << "seed 4, round " << round;
    EXPECT_LE(worst, 17 + 2) << "seed 4, round " << round;
  }
}

TEST(UastcEncoder, TwoColoursAndAlphaOfItsOwnComeBackClosely) {
  test::Random random(5);
  for (int round = 0; round < 500; ++round) {
    std::array<std::array<std::uint8_t, 4>, 2> colors;
    for (auto& color : colors)
      for (std::uint8_t& c : color) c = static_cast<std::uint8_t>(random.integer(0, 255));
    TexelBlock texels;
    for (auto& texel : texels) texel = colors[static_cast<std::size_t>(random.integer(0, 1))];
    // Ends of a line between two colours are as fine as the endpoints of the mode: 256 levels, or fewer.
    EXPECT_LE(squared_error(decoded(encode_uastc(texels)), texels), 64 * 2) << "seed 5, round " << round;
    for (auto& texel : texels) {  // alpha that goes its own way
      texel = colors[static_cast<std::size_t>(random.integer(0, 1))];
      texel[3] = random.coin() ? 255 : 0;
    }
    EXPECT_LE(std::sqrt(squared_error(decoded(encode_uastc(texels)), texels) / 64), 4) << "seed 5, round " << round;
  }
}

// The twin: half the weights' bits turned are not half a step.
TEST(UastcEncoder, ADamagedWeightIsNoticed) {
  TexelBlock texels;
  for (std::size_t t = 0; t < 16; ++t) texels[t].fill(static_cast<std::uint8_t>(16 * t + 8)), texels[t][3] = 255;
  AstcBytes bytes = encode_uastc(texels);
  bytes[15] ^= 0xC0;
  EXPECT_GT(squared_error(decoded(bytes), texels), squared_error(decoded(encode_uastc(texels)), texels) + 100);
}

// Invariant UE3, and what write_ktx2 says of itself.
TEST(Ktx2Writer, FilesHaveTheLevelsTransferFunctionAndAlphaThatWereAskedFor) {
  test::Random random(6);
  for (const auto& [width, height] : {std::pair{32, 20}, {4, 4}, {64, 4}})
    for (const bool srgb : {false, true})
      for (const bool alpha : {false, true}) {
        std::vector<std::vector<std::uint8_t>> texels;
        std::vector<LevelToWrite> levels;
        for (int w = width, h = height;; w = std::max(1, w / 2), h = std::max(1, h / 2)) {
          auto& level = texels.emplace_back(static_cast<std::size_t>(w * h * 4));
          const auto color = static_cast<std::uint8_t>(random.integer(0, 255));
          for (std::size_t i = 0; i < level.size(); ++i) level[i] = static_cast<std::uint8_t>(color + i % 4);
          levels.push_back({w, h, level});
          if (w == 1 && h == 1) break;
        }
        const std::string file = write_ktx2(levels, {srgb, alpha});
        EXPECT_EQ(write_ktx2(levels, {srgb, alpha}), file);
        BasisTexture back;
        std::string fault;
        const std::vector<std::uint8_t> bytes(file.begin(), file.end());
        ASSERT_TRUE(decode_ktx2(bytes, BasisTarget::kRgba32, {}, back, fault)) << fault;
        EXPECT_EQ(back.srgb, srgb);
        EXPECT_EQ(back.alpha, alpha);
        ASSERT_EQ(back.levels.size(), levels.size());
        for (std::size_t i = 0; i < levels.size(); ++i) {
          std::vector<std::uint8_t> wanted = texels[i];
          for (std::size_t a = 3; a < wanted.size() && !alpha; a += 4) wanted[a] = 255;
          EXPECT_EQ(back.levels[i].texels, wanted) << i;  // one colour each: exact
        }
      }
}

// Invariant UE2.
TEST(UastcEncoder, BlocksOfEveryChosenModeAreRead) {
  test::Random random(7);
  std::array<int, kModes.size()> seen{};
  for (int round = 0; round < 3000; ++round) {
    TexelBlock texels;
    const int spread = 1 << random.integer(0, 8), kind = random.integer(0, 3);
    const int base[4] = {random.integer(0, 255), random.integer(0, 255), random.integer(0, 255),
                         random.integer(0, 255)};
    for (auto& texel : texels) {
      const int along = random.integer(0, spread);
      for (std::size_t c = 0; c < 4; ++c) {
        const int step = kind == 0   ? along
                         : kind == 1 ? random.integer(0, spread)
                         : c == 3    ? random.integer(0, spread)
                                     : along;
        texel[c] = static_cast<std::uint8_t>(std::clamp(base[c] + step - spread / 2, 0, 255));
      }
      if (kind == 3 || (kind == 0 && round % 2 == 0)) texel[3] = 255;
    }
    const AstcBytes bytes = encode_uastc(texels);
    decoded(bytes);
    for (std::size_t mode = 0; mode < kModes.size(); ++mode)
      if ((bytes[0] & ((1u << kModes[mode].code_bits) - 1)) == kModes[mode].code) ++seen[mode];
  }
  for (const std::size_t mode : {0u, 1u, 5u, 10u, 11u, 12u, 13u, 14u, 18u}) EXPECT_GT(seen[mode], 0) << mode;
}

}  // namespace
}  // namespace tessera::ktx2::uastc_encoder_test
