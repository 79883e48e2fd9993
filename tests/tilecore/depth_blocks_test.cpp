#include "tilecore/depth_blocks.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::depth_blocks_test {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

struct Shape {
  int width, height, spp;
};

TEST(DepthBlocks, HZ1FarthestCoversAllSamples) {
  test::Random random(7);
  for (const auto& [width, height, spp] : {Shape{32, 32, 4}, {1, 1, 1}, {13, 5, 3}, {256, 17, 64}, {9, 8, 7}}) {
    const auto samples = static_cast<std::size_t>(width * height * spp);
    std::vector<float> z(samples, kNothing);
    DepthBlocks blocks;
    blocks.start(samples, width, spp);
    EXPECT_EQ(blocks.farthest(z), kNothing);
    for (std::size_t s = 0; s < samples; ++s) {
      EXPECT_EQ(blocks.farthest(z), kNothing);
      z[s] = random.uniform(1, 2);
      blocks.touch(s, true);
    }
    for (int round = 0; round < 20; ++round) {
      ASSERT_EQ(blocks.farthest(z), *std::max_element(z.begin(), z.end())) << width << "x" << height << "x" << spp;
      for (int k = 0; k < 50; ++k) {
        const auto s = static_cast<std::size_t>(random.integer(0, static_cast<int>(samples) - 1));
        z[s] *= 0.9f;
        blocks.touch(s, false);
      }
    }
  }
}

// farthest() of some pixels is the farthest depth of the samples in the blocks that hold these pixels.
TEST(DepthBlocks, HZ1FarthestOfSomePixelsCoversTheirBlocks) {
  constexpr int kWidth = 37, kHeight = 21, kSpp = 2;
  constexpr std::size_t kSamples = kWidth * kHeight * kSpp;
  test::Random random(11);
  std::vector<float> z(kSamples, kNothing);
  DepthBlocks blocks;
  blocks.start(kSamples, kWidth, kSpp);
  int open = 0, smaller = 0;
  for (int round = 0; round < 4000; ++round) {
    for (int k = 0; k < 3; ++k) {
      const auto s = static_cast<std::size_t>(random.integer(0, kSamples - 1));
      const bool first = z[s] == kNothing;
      z[s] = first ? random.uniform(1, 2) : z[s] * 0.9f;
      blocks.touch(s, first);
    }
    const int x0 = random.integer(0, kWidth - 1), y0 = random.integer(0, kHeight - 1);
    const IntRect pixels{x0, y0, random.integer(x0 + 1, kWidth), random.integer(y0 + 1, kHeight)};
    float expected = 0;
    for (std::size_t s = 0; s < kSamples; ++s) {
      const int x = static_cast<int>(s) / kSpp % kWidth / 8, y = static_cast<int>(s) / kSpp / kWidth / 8;
      if (x >= pixels.x0 / 8 && x <= (pixels.x1 - 1) / 8 && y >= pixels.y0 / 8 && y <= (pixels.y1 - 1) / 8)
        expected = std::max(expected, z[s]);
    }
    ASSERT_EQ(blocks.farthest(z, pixels), expected);
    open += expected == kNothing ? 1 : 0;
    smaller += expected < *std::max_element(z.begin(), z.end()) ? 1 : 0;
  }
  EXPECT_GT(open, 400);
  EXPECT_GT(smaller, 400);
}

TEST(DepthBlocks, HZ2CountsEachBlockThatWasTouchedOnce) {
  constexpr int kWidth = 20, kHeight = 18, kSpp = 3;  // 3x3 blocks
  constexpr std::size_t kSamples = kWidth * kHeight * kSpp;
  std::vector<float> z(kSamples, kNothing);
  DepthBlocks blocks;
  blocks.start(kSamples, kWidth, kSpp);
  for (std::size_t s = 0; s + 1 < kSamples; ++s) {
    z[s] = 1;
    blocks.touch(s, true);
  }
  blocks.farthest(z);
  EXPECT_EQ(blocks.take_updates(), 0u) << "one sample sees nothing";
  blocks.farthest(z, {0, 0, 9, 8});
  EXPECT_EQ(blocks.take_updates(), 2u) << "not of these blocks";
  z[kSamples - 1] = 1;
  blocks.touch(kSamples - 1, true);
  blocks.farthest(z);
  EXPECT_EQ(blocks.take_updates(), 7u);
  test::Random random(3);
  for (int round = 0; round < 100; ++round) {
    std::set<int> touched;
    for (int k = random.integer(0, 6); k > 0; --k) {
      const int s = random.integer(0, kSamples - 1), pixel = s / kSpp;
      touched.insert(pixel / kWidth / 8 * 3 + pixel % kWidth / 8);
      z[static_cast<std::size_t>(s)] = random.uniform(0, 1);
      blocks.touch(static_cast<std::size_t>(s), false);
    }
    blocks.farthest(z);
    blocks.farthest(z);
    EXPECT_EQ(blocks.take_updates(), touched.size());
  }
}

// A sample that is written and not touched leaves the block as it was.
TEST(DepthBlocksTwin, AForgottenTouchIsNoticed) {
  std::vector<float> z(64, 1.0f);
  DepthBlocks blocks;
  blocks.start(64, 8, 1);
  for (std::size_t s = 0; s < 64; ++s) blocks.touch(s, true);
  ASSERT_EQ(blocks.farthest(z), 1.0f);
  std::fill(z.begin(), z.end(), 0.5f);
  EXPECT_NE(blocks.farthest(z), 0.5f);
}

}  // namespace
}  // namespace tessera::tilecore::depth_blocks_test
