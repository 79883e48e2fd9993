#include "tilecore/resolve/checkerboard.h"
#include "tests/support/tests.h"
#include "tests/tilecore/resolve/window.h"

namespace tessera::tilecore::checkerboard_test {
namespace {

using windows::Random;
using windows::Window;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Filled {
  std::array<Vec4, 16> color{};
  BlockMask unfilled = 0;
  CheckerboardWork work;
};
Filled fill(const Window& window, BlockMask missing, const CheckerboardHistory& history = {}) {
  Filled f;
  f.unfilled = reconstruct_checkerboard(window.view(), missing, history, f.color.data(), f.work);
  return f;
}

Window random_window(std::uint32_t frame) {
  Random random(frame + 1);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  window.usable = windows::repeated(checkerboard_mask(frame));
  return window;
}

TEST(Checkerboard, MissingPixelsAreTheMeanOfTheirFourNeighbours) {
  for (const std::uint32_t frame : {0u, 1u}) {
    const Window window = random_window(frame);
    const auto missing = static_cast<BlockMask>(~checkerboard_mask(frame));
    const Filled got = fill(window, missing);
    EXPECT_EQ(got.unfilled, 0);
    EXPECT_EQ(got.work.pixels, 8u);
    EXPECT_EQ(got.work.taps, 32u);
    for (int p = 0; p < 16; ++p) {
      const int x = p % 4 + 3, y = p / 4 + 3;
      const DVec4 mean = (DVec4(window.at(x - 1, y)) + DVec4(window.at(x + 1, y)) + DVec4(window.at(x, y - 1)) +
                          DVec4(window.at(x, y + 1))) /
                         4.0;
      for (int c = 0; c < 4; ++c)
        EXPECT_NEAR(static_cast<double>(got.color[static_cast<std::size_t>(p)][c]), missing >> p & 1 ? mean[c] : 0.0,
                    1e-4);
    }
  }
}

TEST(Checkerboard, UnusableAndNonFiniteNeighboursAreLeftOut) {
  Window window = random_window(0);
  window.usable[3] &= static_cast<std::uint16_t>(~(1u << 3));  // left of pixel (1, 0)
  window.at(5, 3) = Vec4(kNan);                                // right of it
  const Filled got = fill(window, 1u << 1);
  const DVec4 mean = (DVec4(window.at(4, 2)) + DVec4(window.at(4, 4))) / 2.0;
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(static_cast<double>(got.color[1][c]), mean[c], 1e-4);
  EXPECT_EQ(got.work.non_finite_pixels, 1u);
  EXPECT_EQ(got.work.taps, 3u);
}

TEST(Checkerboard, AFlatColourIsExact) {
  Window window = random_window(1);
  window.fill([](int, int) { return Vec4(0.1f, 0.7f, 1e30f, -1e-38f); });
  const auto missing = static_cast<BlockMask>(~checkerboard_mask(1));
  const Filled got = fill(window, missing);
  for (int p = 0; p < 16; ++p)
    if (missing >> p & 1) {
      EXPECT_EQ(got.color[static_cast<std::size_t>(p)], window.at(0, 0));
    }
}

TEST(Checkerboard, ThePreviousFramesPixelIsTakenWithinTheRangeOfItsNeighbours) {
  Window window = random_window(0);
  std::array<Vec4, 16> previous;
  Random random(8);
  for (Vec4& c : previous) c = 3.0f * windows::random_color(random);
  const auto missing = static_cast<BlockMask>(~checkerboard_mask(0));
  const BlockMask valid = 0x00ff;
  const Filled plain = fill(window, missing), got = fill(window, missing, {previous.data(), valid});
  EXPECT_EQ(got.work.history_pixels, 4u);
  int clamped = 0;
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const auto i = static_cast<std::size_t>(p);
    if (!(valid >> p & 1)) {
      EXPECT_EQ(got.color[i], plain.color[i]);
      continue;
    }
    const int x = p % 4 + 3, y = p / 4 + 3;
    const Vec4 low = glm::min(glm::min(window.at(x - 1, y), window.at(x + 1, y)),
                              glm::min(window.at(x, y - 1), window.at(x, y + 1)));
    const Vec4 high = glm::max(glm::max(window.at(x - 1, y), window.at(x + 1, y)),
                               glm::max(window.at(x, y - 1), window.at(x, y + 1)));
    EXPECT_EQ(got.color[i], glm::clamp(previous[i], low, high));
    clamped += got.color[i] != previous[i];
  }
  EXPECT_GT(clamped, 0);
  // A pixel that did not change is as it was: no blur.
  previous.fill(0.5f * (window.at(3, 3) + window.at(5, 3)));
  EXPECT_EQ(fill(window, 1u << 1, {previous.data(), kFullBlock}).color[1], previous[1]);
  // NaN is not taken over.
  previous.fill(Vec4(kNan));
  const Filled bad = fill(window, missing, {previous.data(), kFullBlock});
  EXPECT_EQ(bad.color, plain.color);
  EXPECT_EQ(bad.work.non_finite_pixels, 8u);
}

TEST(Checkerboard, WithoutAnyNeighbourThePixelIsReported) {
  Window window = random_window(0);
  const auto missing = static_cast<BlockMask>(~checkerboard_mask(0));
  window.usable.fill(0);
  std::array<Vec4, 16> previous{};
  EXPECT_EQ(fill(window, missing, {previous.data(), kFullBlock}).unfilled, missing);
  // A usable bit on a missing pixel is none.
  window.usable.fill(0x3ff);
  EXPECT_EQ(fill(window, kFullBlock).unfilled, 0x0660);
}

}  // namespace
}  // namespace tessera::tilecore::checkerboard_test
