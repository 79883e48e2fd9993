// Decisions for blocks larger than 4x4.
#include "tilecore/resolve/joint_decision.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::joint_decision_test {
namespace {

BlockEvidence any_evidence(test::Random& random) {
  BlockEvidence b;
  b.edge = random.integer(0, 7) == 0;
  b.outline = b.edge && random.coin();
  b.still = random.integer(0, 3) == 0;
  b.velocity_usable = random.integer(0, 9) != 0;
  b.speed = b.still ? 0.0f : random.uniform(0, 12);
  b.blurred_speed = random.coin() ? random.uniform(0, 30) : std::numeric_limits<float>::infinity();
  b.advection_allowed = random.integer(0, 3) != 0;
  b.blur = random.uniform(0, 3);
  b.max_samples = std::array{4, 8, 16, 32}[static_cast<std::size_t>(std::min(random.integer(0, 60), 3))];
  return b;
}

bool same(const BlockDecision& a, const BlockDecision& b) {
  return a.samples == b.samples && a.advect == b.advect && a.blurred == b.blurred;
}

TEST(JointDecision, OfOnePartItIsThatPart) {  // JD1
  test::Random random(3);
  for (int n = 0; n < 2000; ++n) {
    const BlockEvidence one = any_evidence(random);
    for (const BlockSpeed statistic : {BlockSpeed::kMean, BlockSpeed::kMax, BlockSpeed::kMedian, BlockSpeed::kMin})
      EXPECT_TRUE(same(select_rate({}, join(std::array{one}, statistic)), select_rate({}, one)));
  }
}

TEST(JointDecision, WhatForbidsARateInOnePartForbidsItInAll) {  // JD2
  test::Random random(4);
  int full = 0, advected = 0;
  for (int n = 0; n < 5000; ++n) {
    std::vector<BlockEvidence> parts(static_cast<std::size_t>(random.integer(2, 16)));
    for (BlockEvidence& part : parts) part = any_evidence(random);
    if (n % 2 == 0)
      for (BlockEvidence& part : parts) part.edge = part.outline = false, part.velocity_usable = true;
    const BlockDecision all = select_rate({}, join(parts, BlockSpeed::kMean));
    for (const BlockEvidence& part : parts) {
      EXPECT_LE(all.samples, part.max_samples);
      if (all.advect) {
        EXPECT_TRUE(part.advection_allowed);
        EXPECT_TRUE(!part.edge || part.outline);
      } else if (part.edge) {
        EXPECT_EQ(all.samples, std::min(16, join(parts, BlockSpeed::kMean).max_samples));
      }
    }
    full += all.samples == 16, advected += all.advect;
  }
  EXPECT_GT(full, 100);
  EXPECT_GT(advected, 10);
}

TEST(JointDecision, TheSpeedIsTheChosenStatisticOfTheParts) {
  std::vector<BlockEvidence> parts(4);
  const float speeds[] = {1, 2, 4, 9};
  for (std::size_t i = 0; i < 4; ++i) parts[i].velocity_usable = true, parts[i].speed = speeds[i];
  EXPECT_EQ(join(parts, BlockSpeed::kMean).speed, 4);
  EXPECT_EQ(join(parts, BlockSpeed::kMax).speed, 9);
  EXPECT_EQ(join(parts, BlockSpeed::kMin).speed, 1);
  EXPECT_EQ(join(parts, BlockSpeed::kMedian).speed, 3);
  parts.pop_back();
  EXPECT_EQ(join(parts, BlockSpeed::kMedian).speed, 2);
}

TEST(JointDecision, TheContrastIsTheLargestOfTheParts) {  // JD2
  std::vector<BlockEvidence> parts(3);
  for (BlockEvidence& part : parts) part.velocity_usable = true, part.speed = 3, part.max_samples = 16;
  EXPECT_EQ(select_rate({}, join(parts, BlockSpeed::kMean)).samples, 8);
  parts[1].contrast = 0.5f;
  EXPECT_EQ(join(parts, BlockSpeed::kMean).contrast, 0.5f);
  EXPECT_EQ(select_rate({}, join(parts, BlockSpeed::kMean)).samples, 16);
}

}  // namespace
}  // namespace tessera::tilecore::joint_decision_test
