#include "tilecore/resolve/pattern_dither.h"
#include "tests/support/tests.h"
#include "tests/tilecore/resolve/window.h"

namespace tessera::tilecore::pattern_dither_test {
namespace {

constexpr std::uint32_t kFrames[] = {0, 1, 2, 3, 4, 17, 0x7fffffff, 0xfffffffd, 0xfffffffe, 0xffffffff};
const DitherSettings kCounted = {DitherOrder::kCounter, 0}, kSeeded = {DitherOrder::kSeeded, 5};

int squares_in(BlockMask mask) {
  int count = 0;
  for (int p = 0; p < 4; ++p) count += (mask & sparse_square(p & 1, p >> 1)) == sparse_square(p & 1, p >> 1);
  return count;
}

TEST(PatternDither, MasksHaveTheirRateAndAreMadeOfSparseSquares) {  // PD1
  for (const DitherSettings& settings : {kCounted, kSeeded})
    for (const std::uint32_t frame : kFrames) {
      const BlockMask four = dither_mask(4, frame, settings), eight = dither_mask(8, frame, settings);
      EXPECT_EQ(std::popcount(four), 4);
      EXPECT_EQ(squares_in(four), 1);
      EXPECT_EQ(std::popcount(eight), 8);
      EXPECT_EQ(squares_in(eight), 2);
      EXPECT_EQ(dither_mask(16, frame, settings), kFullBlock);
    }
}

// How long the pixel that waits longest is not rendered, over 64 frames from `first`.
int longest_wait(int rate, const DitherSettings& settings, std::uint32_t first) {
  std::array<int, 16> wait{};
  int longest = 0;
  for (std::uint32_t f = 0; f < 64; ++f) {
    const BlockMask mask = dither_mask(rate, first + f, settings);
    for (std::size_t p = 0; p < 16; ++p) {
      wait[p] = mask >> p & 1 ? 0 : wait[p] + 1;
      longest = std::max(longest, wait[p] + 1);
    }
  }
  return longest;
}

TEST(PatternDither, TheCounterRendersEveryPixelOncePerPeriodAcrossTheWrapOfTheFrameNumber) {  // PD2
  for (const int rate : {4, 8})
    for (const std::uint32_t first : {0u, 3u, 0xffffffe1u}) EXPECT_EQ(longest_wait(rate, kCounted, first), 16 / rate);
  // The failing twin: chance lets some pixel wait longer.
  EXPECT_GT(longest_wait(4, kSeeded, 0), 4);
  EXPECT_GT(longest_wait(8, kSeeded, 0), 2);
}

// By the masks alone: counts, pixel by pixel, of the pixels that four frames in a row render.
TEST(PatternDither, FourFramesInARowRenderEveryPixelAsOftenAsAnyOther) {  // PD2
  for (const int rate : {4, 8, 16})
    for (const std::uint32_t first : kFrames)
      for (int p = 0; p < 16; ++p) {
        int rendered = 0;
        for (std::uint32_t f = 0; f < 4; ++f) rendered += dither_mask(rate, first + f, kCounted) >> p & 1;
        EXPECT_EQ(rendered, rate / 4);
      }
}

TEST(PatternDither, SeedsDecideAndAreRepeatable) {
  int differ = 0;
  for (std::uint32_t frame = 0; frame < 64; ++frame) {
    const DitherSettings one{DitherOrder::kSeeded, 1}, two{DitherOrder::kSeeded, 2};
    EXPECT_EQ(dither_mask(4, frame, one), dither_mask(4, frame, one));
    differ += dither_mask(4, frame, one) != dither_mask(4, frame, two);
  }
  EXPECT_GT(differ, 32);
}

// With squares every second row has no witness.
TEST(PatternDither, WitnessesAreOneInEachRowAndColumnAndOnceInFourFramesEach) {  // PD1, PD2
  for (const DitherSettings& settings : {kCounted, kSeeded})
    for (const std::uint32_t frame : kFrames) {
      const unsigned mask = dither_mask(4, frame, settings, true);
      unsigned columns = 0;
      for (int y = 0; y < 4; ++y) {
        const unsigned row = mask >> (4 * y) & 15u;
        EXPECT_EQ(std::popcount(row), 1);
        columns |= row;
      }
      EXPECT_EQ(columns, 15u);
      for (const int rate : {8, 16})
        EXPECT_EQ(dither_mask(rate, frame, settings, true), dither_mask(rate, frame, settings));
    }
  for (const std::uint32_t first : kFrames) {
    unsigned seen = 0;
    for (std::uint32_t f = 0; f < 4; ++f) seen |= dither_mask(4, first + f, kCounted, true);
    EXPECT_EQ(seen, kFullBlock);
  }
}

TEST(PatternDither, EightSamplesAreTheCheckerboard) {
  for (const std::uint32_t frame : kFrames) EXPECT_EQ(checkerboard_mask(frame), dither_mask(8, frame, {}));
  EXPECT_EQ(checkerboard_mask(0) ^ checkerboard_mask(1), kFullBlock);
}

// ---- Why these pairs and this order -------------------------------------------------------------------------------

// Mean square error of `pixels` of a block over sinusoids of `wavelength` pixels in all directions and phases.
double square_error(const std::vector<BlockMask>& frames, double wavelength) {
  double error = 0;
  int count = 0;
  for (int direction = 0; direction < 24; ++direction)
    for (int phase = 0; phase < 8; ++phase) {
      const double angle = direction * M_PI / 24, kx = 2 * M_PI / wavelength * std::cos(angle),
                   ky = 2 * M_PI / wavelength * std::sin(angle);
      const auto truth = [&](int x, int y) { return static_cast<float>(std::sin(kx * x + ky * y + phase * M_PI / 4)); };
      std::array<double, 16> mean{};
      for (const BlockMask mask : frames) {
        windows::Window window;
        window.fill([&](int x, int y) { return Vec4(truth(x - 3, y - 3)); });
        window.usable = windows::repeated(mask);
        std::array<Vec4, 16> out;
        ReconstructionWork work;
        const auto missing = static_cast<BlockMask>(~mask);
        EXPECT_EQ(reconstruct_block(Reconstruction::kCubic, window.view(), missing, out.data(), work), 0);
        for (int p = 0; p < 16; ++p)
          mean[static_cast<std::size_t>(p)] +=
              static_cast<double>(missing >> p & 1 ? out[static_cast<std::size_t>(p)].x : truth(p % 4, p / 4));
      }
      for (int p = 0; p < 16; ++p, ++count) {
        const double e = mean[static_cast<std::size_t>(p)] / static_cast<double>(frames.size()) -
                         static_cast<double>(truth(p % 4, p / 4));
        error += e * e;
      }
    }
  return error / count;
}

TEST(PatternDither, DiagonalPairsLeaveLessErrorThanRowsOrColumns) {
  const auto pair = [](int x0, int y0, int x1, int y1) {
    return static_cast<BlockMask>(sparse_square(x0, y0) | sparse_square(x1, y1));
  };
  for (const double wavelength : {6.0, 8.0, 16.0}) {
    const double diagonal = std::sqrt(square_error({kPairOrder[0]}, wavelength));
    const double rows = std::sqrt(square_error({pair(0, 0, 1, 0)}, wavelength)),
                 columns = std::sqrt(square_error({pair(0, 0, 0, 1)}, wavelength));
    EXPECT_GT(rows, 1.3 * diagonal) << wavelength;
    EXPECT_GT(columns, 1.3 * diagonal) << wavelength;
    RecordProperty("rows_over_diagonal_at_" + std::to_string(static_cast<int>(wavelength)),
                   std::to_string(rows / diagonal));
  }
}

// An eye that averages two frames in a row sees less error when their squares are diagonal neighbours.
TEST(PatternDither, TwoFramesInARowAverageBestWhenDiagonal) {
  const auto over_pairs = [](const std::array<BlockMask, 4>& order, double wavelength) {
    double sum = 0;
    for (std::size_t f = 0; f < 4; ++f) sum += square_error({order[f], order[(f + 1) % 4]}, wavelength);
    return std::sqrt(sum / 4);
  };
  const std::array<BlockMask, 4> around = {sparse_square(0, 0), sparse_square(1, 0), sparse_square(1, 1),
                                           sparse_square(0, 1)};
  for (const double wavelength : {6.0, 8.0, 16.0}) {
    const double chosen = over_pairs(kSquareOrder, wavelength), other = over_pairs(around, wavelength);
    EXPECT_LT(chosen, other) << wavelength;
    RecordProperty("around_over_chosen_at_" + std::to_string(static_cast<int>(wavelength)),
                   std::to_string(other / chosen));
  }
}

}  // namespace
}  // namespace tessera::tilecore::pattern_dither_test
