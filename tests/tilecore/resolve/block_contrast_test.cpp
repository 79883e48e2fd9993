// Contrast that a block leaves to the next frame, and the lines of samples on a tile's border.
#include "tilecore/resolve/block_contrast.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/rate_selector.h"
#include "tilecore/resolve/tile_border.h"

namespace tessera::tilecore::block_contrast_test {
namespace {

using Colors = std::array<Vec4, 16>;

// Linear light that a display shows as v(x, y), about.
template <class Value>
Colors shown_as(const Value& value) {
  Colors colors;
  for (int p = 0; p < 16; ++p) {
    const float v = value(p % 4, p / 4);
    colors[static_cast<std::size_t>(p)] = Vec4(v * v, v * v, v * v, 1.0f);
  }
  return colors;
}

float contrast(const Colors& colors, BlockMask known) {
  std::uint64_t operations = 0;
  return measure_contrast(colors.data(), 4, known, operations).contrast;
}

TEST(BlockContrast, RampsHaveNoneAndCheckersAllOfIt) {  // BC1
  const Colors ramp = shown_as(
                   [](int x, int y) { return 0.2f + 0.1f * static_cast<float>(x) + 0.05f * static_cast<float>(y); }),
               checker = shown_as([](int x, int y) { return (x + y) % 2 == 0 ? 0.3f : 0.7f; }),
               cells = shown_as([](int x, int y) { return (x / 2 + y / 2) % 2 == 0 ? 0.3f : 0.7f; });
  for (const BlockMask known : {kFullBlock, kPairOrder[0], kPairOrder[1], kSquareOrder[0], kSquareOrder[3]})
    EXPECT_NEAR(contrast(ramp, known), 0, 1e-6f) << known;
  EXPECT_NEAR(contrast(checker, kFullBlock), 0.4f, 1e-6f);
  EXPECT_GT(contrast(cells, kPairOrder[0]), 0.1f);
  // Half of the pixels of a checker show one of its colours: only full shading can tell it from a flat surface.
  EXPECT_NEAR(contrast(checker, kPairOrder[0]), 0, 1e-6f);
  EXPECT_NEAR(contrast(cells, kSquareOrder[0]), 0.4f, 1e-6f);
}

TEST(BlockContrast, ColoursBeyondWhiteOrNotFiniteAreWhiteOrBlack) {
  Colors colors;
  colors.fill(Vec4(5.0f));
  colors[5] = Vec4(1e30f, std::numeric_limits<float>::infinity(), 1.0f, 1.0f);
  EXPECT_EQ(contrast(colors, kFullBlock), 0);
  colors[5].x = std::nanf("");
  EXPECT_GT(contrast(colors, kFullBlock), 0);
  EXPECT_TRUE(std::isfinite(contrast(colors, kFullBlock)));
}

TEST(BlockContrast, CodesDoNotUnderstate) {  // BC2
  float last = -1;
  for (int i = 0; i <= 10000; ++i) {
    const float v = static_cast<float>(i) * 1e-4f;
    const std::uint8_t code = contrast_code(v);
    EXPECT_NE(code, kUnknownContrast);
    EXPECT_GE(contrast_of(code), v * (1 - 1e-6f));
    EXPECT_LE(contrast_of(code), v + 0.009f);
    EXPECT_GE(contrast_of(code), last);
    last = contrast_of(code);
  }
  EXPECT_EQ(contrast_code(7.0f), contrast_code(1.0f));
  EXPECT_EQ(contrast_code(std::nanf("")), kUnknownContrast);
  EXPECT_TRUE(std::isinf(contrast_of(kUnknownContrast)));
}

TEST(BlockContrast, RaisesARateAndNeverLowersOne) {
  RateSettings settings;
  BlockEvidence block;
  block.velocity_usable = true;
  for (const float speed : {0.5f, 3.0f, 20.0f}) {
    block.speed = speed;
    int last = 0;
    for (const float c : {0.0f, 0.005f, 0.01f, 0.04f, 1.0f, contrast_of(kUnknownContrast)}) {
      block.contrast = c;
      const int samples = select_rate(settings, block).samples;
      EXPECT_GE(samples, last);
      last = samples;
    }
    EXPECT_EQ(last, 16);
    settings.pattern_error = 0;
    EXPECT_EQ(select_rate(settings, block).samples, speed < 2 ? 16 : speed < 8 ? 8 : 4);
    settings.pattern_error = RateSettings().pattern_error;
  }
}

TEST(TileBorder, EveryPixelOfAQuarterLiesBetweenRenderedOnes) {  // TLB1
  for (const BlockMask pattern : kSquareOrder)
    for (unsigned borders = 0; borders < kBorderCases; ++borders) {
      const auto rendered = static_cast<BlockMask>(pattern | border_line(pattern, borders));
      unsigned columns = 0, rows = 0;
      for (int y = 0; y < 4; ++y) {
        columns |= rendered >> (4 * y) & 15u;
        rows |= (rendered >> (4 * y) & 15u) != 0 ? 1u << y : 0u;
      }
      EXPECT_TRUE((borders & kLeftBorder) == 0 || (columns & 1u));
      EXPECT_TRUE((borders & kRightBorder) == 0 || (columns & 8u));
      EXPECT_TRUE((borders & kTopBorder) == 0 || (rows & 1u));
      EXPECT_TRUE((borders & kBottomBorder) == 0 || (rows & 8u));
      EXPECT_LE(std::popcount(rendered), 9);
      EXPECT_EQ(border_line(rendered, borders), 0);  // nothing more to add
    }
}

TEST(TileBorder, BlocksInsideAreLeftAloneAndHalvesButForCorners) {  // TLB2
  for (const BlockMask pattern : kSquareOrder) EXPECT_EQ(border_line(pattern, 0), 0);
  for (unsigned borders = 0; borders < kBorderCases; ++borders) {
    for (const BlockMask pattern : kPairOrder) EXPECT_EQ(border_line(pattern, borders) & ~0x9009, 0);
    EXPECT_EQ(border_line(kFullBlock, borders), 0);
  }
  EXPECT_EQ(tile_borders({0, 0, 32, 32}, {28, 0, 32, 4}), kRightBorder | kTopBorder);
  EXPECT_EQ(tile_borders({0, 0, 32, 32}, {4, 4, 8, 8}), 0u);
}

}  // namespace
}  // namespace tessera::tilecore::block_contrast_test
