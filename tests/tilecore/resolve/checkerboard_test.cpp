#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "tests/tilecore/resolve/window.h"
#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {
namespace {

using test::Random;
using test::Window;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Filled {
  std::array<Vec4, 16> color{};
  BlockMask unfilled = 0;
  ReconstructionWork work;
};
Filled fill(const Window& window, BlockMask missing) {
  Filled f;
  f.unfilled = reconstruct_checkerboard(window.view(), missing, f.color.data(), f.work);
  return f;
}

Window random_window(std::uint32_t frame) {
  Random random(frame + 1);
  Window window;
  window.fill([&](int, int) { return test::random_color(random); });
  window.usable = test::repeated(checkerboard_mask(frame));
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

TEST(Checkerboard, WithoutAnyNeighbourThePixelIsReported) {
  Window window = random_window(0);
  const auto missing = static_cast<BlockMask>(~checkerboard_mask(0));
  window.usable.fill(0);
  EXPECT_EQ(fill(window, missing).unfilled, missing);
  // A usable bit on a missing pixel is none.
  window.usable.fill(0x3ff);
  EXPECT_EQ(fill(window, kFullBlock).unfilled, 0x0660);
}

}  // namespace
}  // namespace tessera::tilecore
