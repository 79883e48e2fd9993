// Highlights in windows of stencils: no colour outside of the range of its surroundings, and none below zero.
#include "tilecore/resolve/bright_window.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore::bright_window_test {
namespace {

struct Window {
  std::array<Vec4, std::size_t{kWindowSide} * kWindowSide> colors;
  BlockWindow view{colors.data(), kWindowSide, {}};
};

// Every other pixel rendered, with highlights of any brightness.
void fill(test::Random& random, float brightest, Window& window) {
  for (std::size_t y = 0; y < kWindowSide; ++y) {
    window.view.usable[y] = y % 2 == 0 ? 0b0101010101 : 0b1010101010;
    for (std::size_t x = 0; x < kWindowSide; ++x) {
      const float light = random.integer(0, 7) == 0 ? random.uniform(0, brightest) : random.uniform(0, 0.2f);
      window.colors[y * kWindowSide + x] = {light, light * 0.5f, random.uniform(0.01f, 0.3f), 1.0f};
    }
  }
}

TEST(BrightWindow, KeepsTheRangeOfItsSurroundings) {  // BRW1
  test::Random random(4);
  int negative = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Window window;
    fill(random, 60, window);
    if (!BrightWindow::is_bright(window.view)) continue;
    Vec4 low(3e38f), high(-3e38f);
    BlockMask missing = 0;
    for (std::size_t y = 0; y < kWindowSide; ++y)
      for (std::size_t x = 0; x < kWindowSide; ++x) {
        const bool usable = (window.view.usable[y] >> x & 1) != 0;
        if (usable)
          low = glm::min(low, window.colors[y * kWindowSide + x]),
          high = glm::max(high, window.colors[y * kWindowSide + x]);
        if (!usable && x >= kWindowMargin && x < kWindowMargin + 4 && y >= kWindowMargin && y < kWindowMargin + 4)
          missing = static_cast<BlockMask>(missing | 1u << (4 * (y - kWindowMargin) + x - kWindowMargin));
      }
    const BrightWindow bright(window.view);
    Vec4 out[16], plain[16];
    ReconstructionWork work;
    ASSERT_EQ(reconstruct_block(Reconstruction::kCubic, bright.window(), missing, out, work), 0);
    ASSERT_EQ(reconstruct_block(Reconstruction::kCubic, window.view, missing, plain, work), 0);
    for (int p = 0; p < 16; ++p) {
      if ((missing >> p & 1) == 0) continue;
      const Vec4 light = bright.light(out[p]);
      for (int c = 0; c < 4; ++c) {
        EXPECT_GE(light[c], low[c] * (1 - 1e-5f));
        EXPECT_LE(light[c], high[c] * (1 + 1e-4f));
      }
      negative += plain[p].x < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(negative, 20) << "the twin: stencils over light fall below zero";
}

TEST(BrightWindow, ColorsUpToWhiteStay) {  // BRW2
  test::Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    Window window;
    fill(random, 1.0f, window);
    EXPECT_FALSE(BrightWindow::is_bright(window.view));
    window.colors[0] = Vec4(std::numeric_limits<float>::infinity());
    EXPECT_FALSE(BrightWindow::is_bright(window.view)) << "nothing is known of such a pixel";
  }
}

}  // namespace
}  // namespace tessera::tilecore::bright_window_test
