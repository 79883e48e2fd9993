// BasisLZ/ETC1S files that are written here, read back; the codes and codebooks they are made of.
#include "base/ktx2/etc1s_encoder.h"
#include "base/ktx2/bit_reader.h"
#include "base/ktx2/etc1s_fit.h"
#include "base/ktx2/etc2_block.h"
#include "base/ktx2/huffman.h"
#include "base/ktx2/huffman_encoder.h"
#include "base/ktx2/ktx2.h"
#include "base/ktx2/level_blocks.h"
#include "tests/support/tests.h"

namespace tessera::ktx2::etc1s_encoder_test {
namespace {

// ---- Huffman codes ----------------------------------------------------------------------------------------------

// Writes the table and `text`, reads both back.
bool comes_back(const std::vector<std::uint64_t>& counts, const std::vector<std::uint32_t>& text) {
  const HuffmanEncoder encoder(counts);
  BitWriter writer;
  encoder.write_table(writer);
  for (const std::uint32_t symbol : text) encoder.write(symbol, writer);
  const std::string bytes = writer.take();
  BitReader reader({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  HuffmanCode code;
  std::string fault;
  if (!code.read(reader, fault)) return false;
  return std::all_of(text.begin(), text.end(), [&](std::uint32_t symbol) { return code.decode(reader) == symbol; }) &&
         !reader.overrun();
}

TEST(HuffmanEncoder, WhatItWritesIsReadBack) {  // HE1
  Random random(1);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::uint64_t> counts(static_cast<std::size_t>(1 << random.integer(0, 13)));
    const int kind = random.integer(0, 3);
    for (std::uint64_t& count : counts)
      count = kind == 0                                    ? 1u
              : random.integer(0, kind == 1 ? 1 : 40) == 0 ? static_cast<unsigned>(random.integer(0, 9999))
                                                           : 0u;
    std::vector<std::uint32_t> text;
    for (std::uint32_t s = 0; s < counts.size(); ++s)
      if (counts[s] > 0) text.push_back(s);
    std::reverse(text.begin(), text.end());
    EXPECT_TRUE(comes_back(counts, text)) << "seed 1, round " << round;
  }
}

TEST(HuffmanEncoder, NoCodeIsLongerThanSixteenBits) {  // HE2: counts of Fibonacci make the deepest tree
  std::vector<std::uint64_t> counts = {1, 1};
  while (counts.size() < 60) counts.push_back(counts[counts.size() - 1] + counts[counts.size() - 2]);
  std::vector<std::uint32_t> text(counts.size());
  for (std::uint32_t s = 0; s < text.size(); ++s) text[s] = s;
  EXPECT_TRUE(comes_back(counts, text));
}

TEST(HuffmanEncoder, ATableWithoutSymbolsHasOneAllTheSame) {
  EXPECT_TRUE(comes_back({}, {0}));
  EXPECT_TRUE(comes_back({0, 0, 0}, {0}));
  EXPECT_TRUE(comes_back({0, 0, 7}, {2, 2}));
}

// ---- Codebooks --------------------------------------------------------------------------------------------------

double squared_error(const TexelBlock& texels, const Etc1sEndpoint& endpoint, const Etc1sSelector& selector) {
  const auto colors = etc1s_colors(endpoint);
  double sum = 0;
  for (unsigned t = 0; t < 16; ++t)
    for (std::size_t c = 0; c < 3; ++c) sum += std::pow(texels[t][c] - colors[selector.at(t % 4, t / 4)][c], 2);
  return sum;
}

double least_error(const TexelBlock& texels, const Etc1sEndpoint& endpoint) {
  const auto colors = etc1s_colors(endpoint);
  double sum = 0;
  for (unsigned t = 0; t < 16; ++t) {
    double least = 1e9;
    for (const auto& color : colors) {
      double error = 0;
      for (std::size_t c = 0; c < 3; ++c) error += std::pow(texels[t][c] - color[c], 2);
      least = std::min(least, error);
    }
    sum += least;
  }
  return sum;
}

TEST(Etc1sFit, GreyBlocksAreNearlyAsGoodAsTheBestOfAllEndpoints) {  // EF1
  Random random(2);
  double found = 0, best = 0;
  for (int round = 0; round < 300; ++round) {
    TexelBlock texels;
    const int base = random.integer(0, 255), spread = 1 << random.integer(0, 7);
    for (auto& texel : texels) {
      const auto grey = static_cast<std::uint8_t>(std::clamp(base + random.integer(-spread, spread), 0, 255));
      texel = {grey, grey, grey, 255};
    }
    const Etc1sFit fit = fit_etc1s(std::span(&texels, 1));
    ASSERT_EQ(fit.blocks.size(), 1u);
    found += squared_error(texels, fit.endpoints.at(fit.blocks[0].endpoint), fit.selectors.at(fit.blocks[0].selector));
    double least = 1e12;
    for (std::uint8_t grey = 0; grey < 32; ++grey)
      for (std::uint8_t table = 0; table < kEtc1Modifiers.size(); ++table)
        least = std::min(least, least_error(texels, {grey, grey, grey, table}));
    best += least;
  }
  EXPECT_GE(found, best);
  EXPECT_LE(found, 1.25 * best);
}

std::vector<TexelBlock> noise(std::size_t count, std::uint32_t seed) {
  Random random(seed);
  std::vector<TexelBlock> blocks(count);
  for (TexelBlock& block : blocks)
    for (auto& texel : block) {
      for (std::uint8_t& c : texel) c = static_cast<std::uint8_t>(random.integer(0, 255));
      texel[3] = 255;
    }
  return blocks;
}

TEST(Etc1sFit, CodebooksStayWithinTheirSizeAndEveryBlockIsInThem) {  // EF2
  const std::vector<TexelBlock> blocks = noise(9000, 3);
  const Etc1sFit fit = fit_etc1s(blocks), again = fit_etc1s(blocks);
  EXPECT_GT(fit.endpoints.size(), kMaxEndpoints / 2);
  EXPECT_LE(fit.endpoints.size(), kMaxEndpoints);
  EXPECT_EQ(fit.selectors.size(), kMaxSelectors);
  ASSERT_EQ(fit.blocks.size(), blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    ASSERT_LT(fit.blocks[b].endpoint, fit.endpoints.size());
    ASSERT_LT(fit.blocks[b].selector, fit.selectors.size());
    EXPECT_EQ(fit.blocks[b].endpoint, again.blocks[b].endpoint);
    EXPECT_EQ(fit.blocks[b].selector, again.blocks[b].selector);
  }
}

// ---- Files ------------------------------------------------------------------------------------------------------

// An image of stripes, noise and flat parts, so that all symbols of slices occur: repeats, runs, history, deltas.
std::vector<std::uint8_t> image(int width, int height, std::uint32_t seed) {
  Random random(seed);
  std::vector<std::uint8_t> texels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int part = (x / 24 + y / 40) % 4;
      for (int c = 0; c < 4; ++c) {
        const double wave = 128 + 100 * std::sin(0.11 * x + 0.07 * y * (c + 1));
        texels.push_back(static_cast<std::uint8_t>(part == 0   ? 30 * c + 40
                                                   : part == 1 ? random.integer(0, 255)
                                                   : part == 2 ? wave
                                                               : ((x / 4 + y / 8) % 2) * 200 + 5 * c));
      }
    }
  return texels;
}

BasisTexture read_back(const std::string& file) {
  BasisTexture texture;
  std::string fault;
  EXPECT_TRUE(decode_ktx2({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, BasisTarget::kRgba32, {},
                          texture, fault))
      << fault;
  return texture;
}

TEST(Etc1sEncoder, FilesDecodeToTheColoursOfTheFit) {  // EB1, EB2
  for (const bool alpha : {false, true})
    for (const auto& [width, height] : {std::pair{1, 1}, {4, 4}, {5, 3}, {64, 64}, {150, 37}, {9, 300}, {512, 8}}) {
      const std::vector<std::uint8_t> texels = image(width, height, 7);
      const LevelToWrite level{width, height, texels};
      const std::string file = write_ktx2(std::span(&level, 1), {true, alpha, true});
      EXPECT_EQ(write_ktx2(std::span(&level, 1), {true, alpha, true}), file);
      const BasisTexture back = read_back(file);
      EXPECT_TRUE(back.srgb);
      EXPECT_EQ(back.alpha, alpha);
      // The fit of colour blocks, then alpha blocks, as the encoder makes it.
      std::vector<TexelBlock> blocks = level_blocks(level), greys = blocks;
      const std::size_t count = blocks.size();
      for (TexelBlock& block : greys)
        for (auto& texel : block) texel = {texel[3], texel[3], texel[3], 255};
      if (alpha) blocks.insert(blocks.end(), greys.begin(), greys.end());
      for (TexelBlock& block : blocks)
        for (auto& texel : block) texel[3] = 255;
      const Etc1sFit fit = fit_etc1s(blocks);
      const auto color = [&](std::size_t b, unsigned t) {
        return etc1s_colors(
            fit.endpoints[fit.blocks[b].endpoint])[fit.selectors[fit.blocks[b].selector].at(t % 4, t / 4)];
      };
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const std::size_t b =
              static_cast<std::size_t>(y / 4) * block_columns(level) + static_cast<std::size_t>(x / 4);
          const auto t = static_cast<unsigned>(4 * (y % 4) + x % 4);
          const std::uint8_t* seen = &back.levels[0].texels[4 * static_cast<std::size_t>(y * width + x)];
          const auto wanted = color(b, t);
          ASSERT_TRUE(std::equal(wanted.begin(), wanted.end(), seen))
              << width << "x" << height << " at " << x << "," << y;
          ASSERT_EQ(seen[3], alpha ? color(count + b, t)[1] : 255);
        }
    }
}

TEST(Etc1sEncoder, MipLevelsShareTheCodebooks) {
  std::vector<std::vector<std::uint8_t>> texels;
  std::vector<LevelToWrite> levels;
  for (int w = 96, h = 40;; w = std::max(1, w / 2), h = std::max(1, h / 2)) {
    levels.push_back({w, h, texels.emplace_back(image(w, h, 9))});
    if (w == 1 && h == 1) break;
  }
  for (std::size_t l = 0; l < levels.size(); ++l) levels[l].texels = texels[l];
  const BasisTexture back = read_back(write_ktx2(levels, {false, true, true}));
  ASSERT_EQ(back.levels.size(), levels.size());
  for (std::size_t l = 0; l < levels.size(); ++l) {
    EXPECT_EQ(back.levels[l].width, levels[l].width);
    EXPECT_EQ(back.levels[l].height, levels[l].height);
  }
}

double psnr_of(const std::vector<std::uint8_t>& texels, int side) {
  const LevelToWrite level{side, side, texels};
  const BasisTexture back = read_back(write_ktx2(std::span(&level, 1), {true, false, true}));
  double sum = 0;
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (i % 4 != 3) sum += std::pow(static_cast<double>(texels[i]) - back.levels[0].texels[i], 2);
  return 10 * std::log10(255.0 * 255.0 * 0.75 * static_cast<double>(texels.size()) / sum);
}

TEST(Etc1sEncoder, SoftImagesStayCloseAndNoiseDoesNot) {
  constexpr int kSide = 128;
  std::vector<std::uint8_t> soft, rough;
  Random random(4);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 4; ++c) {
        soft.push_back(static_cast<std::uint8_t>(128 + 60 * std::sin(0.05 * x) + 50 * std::cos(0.04 * y + c)));
        rough.push_back(static_cast<std::uint8_t>(random.integer(0, 255)));
      }
  EXPECT_GT(psnr_of(soft, kSide), 36);
  EXPECT_LT(psnr_of(rough, kSide), 20);  // one colour and four brightnesses a block: the format's limit
}

}  // namespace
}  // namespace tessera::ktx2::etc1s_encoder_test
