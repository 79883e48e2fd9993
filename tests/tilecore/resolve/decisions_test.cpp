// Decisions of the resolve unit before shading: edges, rates, foveation; and after it: discrepancy, the mean of
// samples.
#include <random>

#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/discrepancy.h"
#include "tilecore/resolve/edge_detector.h"
#include "tilecore/resolve/foveation.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/resolve/rate_selector.h"

namespace tessera::tilecore::decisions_test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
using Depths = std::array<float, 16>;

bool edge(const Depths& depth, EdgeMeasure measure = EdgeMeasure::kInverseDepth, float threshold = 0.01f) {
  return detect_edge({measure, threshold, false}, depth.data(), 4, 4, 4);
}

// Depths of the plane n.p = 1 seen through pixels: 1/z is linear on screen.
Depths plane(float inverse, float by_x, float by_y) {
  Depths d;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      d[static_cast<std::size_t>(4 * y + x)] =
          1.0f / (inverse + by_x * static_cast<float>(x) + by_y * static_cast<float>(y));
  return d;
}

TEST(EdgeDetector, InverseDepthSeesNoEdgeOnAnyPlaneAndDepthSeesOneOnSteepPlanes) {
  test::Random random(1);
  int steep = 0;
  for (int i = 0; i < 1000; ++i) {
    const float inverse = random.uniform(0.01f, 2.0f);
    const Depths d = plane(inverse, random.uniform(0, 0.3f) * inverse, random.uniform(0, 0.3f) * inverse);
    EXPECT_FALSE(edge(d)) << i;
    steep += edge(d, EdgeMeasure::kDepth);
  }
  EXPECT_GT(steep, 100);
}

TEST(EdgeDetector, AStepIsAnEdgeAtAnyDepthAndAnyScale) {
  for (const float scale : {1e-3f, 1.0f, 1e3f, 1e6f})
    for (const EdgeMeasure measure : {EdgeMeasure::kDepth, EdgeMeasure::kInverseDepth})
      for (int column = 1; column < 4; ++column) {
        Depths step, shallow;
        for (std::size_t i = 0; i < 16; ++i) {
          step[i] = scale * (static_cast<int>(i % 4) < column ? 1.0f : 1.1f);
          shallow[i] = scale * (static_cast<int>(i % 4) < column ? 1.0f : 1.001f);
        }
        EXPECT_TRUE(edge(step, measure)) << scale << " " << column;
        EXPECT_FALSE(edge(shallow, measure)) << scale << " " << column;
      }
}

TEST(EdgeDetector, NothingBesideSomethingIsAnEdgeAndNothingAloneIsNone) {
  Depths d;
  d.fill(kInfinity);
  EXPECT_FALSE(edge(d));
  d[5] = 1e30f;
  EXPECT_TRUE(edge(d));
  d.fill(1e30f);
  EXPECT_FALSE(edge(d));
}

// Whole blocks are judged row by row at once: as by the definition, pixel by pixel.
TEST(EdgeDetector, EveryPixelOfAWholeBlockCounts) {
  test::Random random(5);
  int edges = 0;
  for (int i = 0; i < 4000; ++i) {
    Depths d = plane(random.uniform(0.1f, 2.0f), random.uniform(0, 0.02f), random.uniform(0, 0.02f));
    d[static_cast<std::size_t>(i % 16)] *= 1.0f + random.uniform(-0.03f, 0.03f);
    for (const EdgeMeasure measure : {EdgeMeasure::kDepth, EdgeMeasure::kInverseDepth}) {
      const auto value = [&](int x, int y) {
        return measure == EdgeMeasure::kDepth ? d[static_cast<std::size_t>(4 * y + x)]
                                              : 1.0f / d[static_cast<std::size_t>(4 * y + x)];
      };
      bool expected = false;
      for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
          const int cx = x < 2 ? 1 : 2, cy = y < 2 ? 1 : 2;
          const float laplacian = (value(cx - 1, y) - 2.0f * value(cx, y) + value(cx + 1, y)) +
                                  (value(x, cy - 1) - 2.0f * value(x, cy) + value(x, cy + 1));
          expected = expected || std::abs(laplacian) > 0.01f * std::abs(value(x, y));
        }
      EXPECT_EQ(edge(d, measure), expected) << i;
      edges += expected;
    }
  }
  EXPECT_GT(edges, 1000);
  EXPECT_LT(edges, 7000);
}

TEST(EdgeDetector, EveryInstructionSetJudgesWholeBlocksAsPixelByPixel) {
  test::Random random(6);
  const float odd[] = {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(), 0.0f, -1.0f, 1e-40f};
  const std::vector<std::string> targets = simd_target_names();
  int edges = 0;
  for (int i = 0; i < 6000; ++i) {
    Depths d = plane(random.uniform(0.1f, 2.0f), random.uniform(0, 0.02f), random.uniform(0, 0.02f));
    d[static_cast<std::size_t>(i % 16)] *= 1.0f + random.uniform(-0.03f, 0.03f);
    for (int n = i % 4; n > 1; --n) d[static_cast<std::size_t>(random.integer(0, 15))] = odd[random.integer(0, 5)];
    if (i % 50 == 0) d.fill(kInfinity);
    for (const EdgeMeasure measure : {EdgeMeasure::kDepth, EdgeMeasure::kInverseDepth}) {
      const bool expected = detect_edge_by_pixel({measure, 0.01f, false}, d.data(), 4, 4, 4);
      for (const std::string& target : targets) {
        force_simd_target(target);
        EXPECT_EQ(edge(d, measure), expected) << target << ", block " << i;
      }
      edges += expected;
    }
  }
  force_simd_target("");
  EXPECT_GT(edges, 3000);
  EXPECT_LT(edges, 11000);
}

TEST(EdgeDetector, BlocksCutByTheFrameUseTheirOwnPixels) {
  Depths d = plane(1, 0, 0);
  d[1] = 2;  // a step along x
  for (int width = 1; width <= 4; ++width)
    for (int height = 1; height <= 4; ++height)
      EXPECT_EQ(detect_edge({EdgeMeasure::kInverseDepth, 0.01f, false}, d.data(), 4, width, height),
                width >= 3 || (height >= 3 && width >= 2))
          << width << "x" << height;
}

BlockEvidence moving(float speed, bool allowed = false) {
  BlockEvidence b;
  b.velocity_usable = true;
  b.speed = speed;
  b.advection_allowed = allowed;
  return b;
}

// Two planes that meet in a block: their angle decides, at any distance and place, and a plane alone never.
TEST(CreaseDetector, NormalsFollowFromDepth) {
  test::Random random(5);
  for (const bool orthographic : {false, true}) {
    scene::Projection projection;
    projection.orthographic = orthographic;
    projection.scale = orthographic ? 100 : 600, projection.center_x = 320, projection.center_y = 180;
    for (int round = 0; round < 400; ++round) {
      const int x = 4 * random.integer(0, 159), y = 4 * random.integer(0, 89);
      const double middle_z = static_cast<double>(random.uniform(0.5f, 200.0f)),
                   angle = static_cast<double>(random.uniform(0.0f, 0.9f));
      // The crease is upright through the block's middle; each side is turned about it by half of the angle.
      const auto place = [&](double pixel, double center) { return (pixel - center) / projection.scale; };
      const DVec3 at = orthographic ? DVec3(place(x + 2, 320), place(y + 2, 180), middle_z)
                                    : DVec3(place(x + 2, 320) * middle_z, place(y + 2, 180) * middle_z, middle_z);
      std::array<float, 16> depth;
      for (int i = 0; i < 16; ++i) {
        const double half = i % 4 < 2 ? -0.5 * angle : 0.5 * angle;
        const DVec3 normal(std::sin(half), 0, -std::cos(half)),
            ray(place(x + i % 4 + 0.5, 320), place(y + i / 4 + 0.5, 180), 1);
        depth[static_cast<std::size_t>(i)] =
            static_cast<float>(orthographic ? (glm::dot(normal, at) - normal.x * ray.x) / normal.z
                                            : glm::dot(normal, at) / glm::dot(normal, ray));
      }
      const double degrees = angle * 57.29577951308232;
      if (degrees > 2) {
        EXPECT_TRUE(CreaseDetector(0.9 * degrees, projection).detect(depth.data(), 4, x, y)) << degrees;
      }
      EXPECT_FALSE(CreaseDetector(1.1 * degrees + 1, projection).detect(depth.data(), 4, x, y)) << degrees;
    }
  }
  EXPECT_FALSE(CreaseDetector(0, {}).on());
}

TEST(RateSelector, SharpBlocksAndBlocksAfterACutAreNotFast) {
  BlockEvidence b;
  b.velocity_usable = true;
  b.speed = 100;
  EXPECT_EQ(select_rate({}, b).samples, 4);
  b.blurred_speed = 1;  // sharp
  EXPECT_EQ(select_rate({}, b).samples, 16);
  b.blurred_speed = 4;
  EXPECT_EQ(select_rate({}, b).samples, 8);
  b.blurred_speed = 100;
  EXPECT_EQ(select_rate({}, b).samples, 4);
  b.cut = true;
  EXPECT_EQ(select_rate({}, b).samples, 16);
  b.speed = 0, b.advection_allowed = true;
  EXPECT_TRUE(select_rate({}, b).advect);
}

TEST(RateSelector, RegimesFollowEachOtherInSpeed) {
  RateSettings settings;
  settings.thresholds = {1, 4, 16, 0};
  const auto rate = [&](const BlockEvidence& b) { return select_rate(settings, b); };
  EXPECT_TRUE(rate(moving(0.5f, true)).advect);
  EXPECT_EQ(rate(moving(0.5f, true)).samples, 16 - settings.advected);
  EXPECT_EQ(rate(moving(0.5f, false)).samples, 16);
  EXPECT_EQ(rate(moving(2, true)).samples, 16);
  EXPECT_EQ(rate(moving(5, true)).samples, 8);
  EXPECT_FALSE(rate(moving(5, true)).advect);
  EXPECT_EQ(rate(moving(17, true)).samples, 4);
  BlockEvidence unknown = moving(17, true);
  unknown.velocity_usable = false;
  EXPECT_EQ(rate(unknown).samples, 16);
}

// Shares of slow blocks that are taken over.
TEST(RateSelector, TheSharesOfSlowBlocksFollowTheSettings) {
  RateSettings settings;
  settings.thresholds = {1, 4, 16, 0};
  for (const int advected : {8, 12}) {
    settings.advected = advected;
    const BlockDecision slow = select_rate(settings, moving(0.5f, true));
    EXPECT_TRUE(slow.advect);
    EXPECT_EQ(slow.samples, 16 - advected);
    EXPECT_EQ(slow.memory(), 1);
    BlockEvidence outline = moving(0.5f, true);
    outline.edge = outline.outline = true;
    EXPECT_TRUE(select_rate(settings, outline).advect);
    EXPECT_EQ(select_rate(settings, outline).samples, 8);
  }
}

TEST(RateSelector, EdgesAreRenderedFullyOrTwiceUnlessEverySampleIsStill) {
  RateSettings settings;
  BlockEvidence b = moving(100, true);
  b.edge = true;
  EXPECT_EQ(select_rate(settings, b).samples, 16);
  settings.supersampling = true;
  EXPECT_EQ(select_rate(settings, b).samples, 32);
  b = moving(0, true);
  b.edge = b.still = true;
  EXPECT_TRUE(select_rate(settings, b).advect);
  b.advection_allowed = false;
  EXPECT_EQ(select_rate(settings, b).samples, 32);
}

// A speed that jitters around a threshold by less than the hysteresis keeps its regime; without hysteresis it flickers.
TEST(RateSelector, ASpeedAtAThresholdDoesNotFlicker) {
  test::Random random(7);
  for (const float threshold : {1.0f, 4.0f, 16.0f})
    for (const float hysteresis : {0.05f, 0.0f}) {
      RateSettings settings;
      settings.thresholds = {1, 4, 16, hysteresis};
      BlockEvidence b = moving(threshold, true);
      int changes = 0;
      std::uint8_t memory = select_rate(settings, b).memory();
      for (int frame = 0; frame < 100; ++frame) {
        b.speed = threshold * random.uniform(0.97f, 1.03f);
        b.last_samples = memory;
        const std::uint8_t next = select_rate(settings, b).memory();
        changes += next != memory && frame > 0;
        memory = next;
      }
      if (hysteresis > 0) {
        EXPECT_LE(changes, 1) << threshold;
      } else {
        EXPECT_GT(changes, 20) << threshold;
      }
      // One that really changes its speed still changes its regime.
      b.speed = threshold * 1.2f;
      b.last_samples = memory;
      const std::uint8_t fast = select_rate(settings, b).memory();
      b.speed = threshold * 0.8f;
      b.last_samples = fast;
      EXPECT_NE(select_rate(settings, b).memory(), fast);
    }
}

TEST(RateSelector, FoveationIsTheSmallerRate) {
  RateSettings settings;
  for (const int most : {4, 8, 16, 32}) {
    BlockEvidence b = moving(0);
    b.max_samples = most;
    EXPECT_EQ(select_rate(settings, b).samples, std::min(16, most));
    b.edge = true;
    settings.supersampling = true;
    EXPECT_EQ(select_rate(settings, b).samples, most);
    settings.supersampling = false;
    EXPECT_EQ(select_rate(settings, moving(1000)).samples, 4);
  }
}

// Colours that foveation filled from some of a block's pixels are no history: the block stays in that regime, however
// slow it is and well seen, and does not alternate between it and taking over the filled colours.
TEST(RateSelector, AFoveatedBlockThatWasFilledIsNotTakenOver) {
  RateSettings settings;
  BlockEvidence block;
  block.velocity_usable = block.advection_allowed = true;
  block.speed = 0.5f;
  for (const int most : {4, 8}) {
    block.max_samples = most;
    block.last_samples = 0;
    EXPECT_TRUE(select_rate(settings, block).advect) << "the previous colours are unknown";
    for (const std::uint8_t last : {std::uint8_t{4}, std::uint8_t{8}}) {
      block.last_samples = last;
      for (int frame = 0; frame < 5; ++frame) {
        const BlockDecision decision = select_rate(settings, block);
        EXPECT_FALSE(decision.advect);
        EXPECT_EQ(decision.samples, most);
        block.last_samples = decision.memory();
      }
    }
    for (const std::uint8_t last : {std::uint8_t{1}, std::uint8_t{16}}) {
      block.last_samples = last;
      EXPECT_TRUE(select_rate(settings, block).advect) << "that was shaded";
    }
  }
  // Without foveation a block that was fast takes over its colours as soon as it is slow.
  block.max_samples = 32;
  block.last_samples = 4;
  EXPECT_TRUE(select_rate(settings, block).advect);
}

TEST(Foveation, StepsAtTheTwoRadii) {
  const Foveation f({10, 20, 0.5, 0.5, ""}, {0.5, 0.5}, 200, 100);
  EXPECT_EQ(f.max_samples({110, 50}), 16);
  EXPECT_EQ(f.max_samples({110.1f, 50}), 8);
  EXPECT_EQ(f.max_samples({100, 70}), 8);
  EXPECT_EQ(f.max_samples({100, 70.1f}), 4);
  EXPECT_EQ(Foveation{}.max_samples({1e9f, 0}), 32);
}

TEST(Discrepancy, DifferencesAreRelativeSymmetricAndSurviveNonsense) {
  const Vec4 a(1, 2, 3, 1), b(1, 2, 4, 1);
  EXPECT_FLOAT_EQ(relative_difference(a, b), 1 / 4.1f);
  EXPECT_EQ(relative_difference(a, b), relative_difference(b, a));
  EXPECT_EQ(relative_difference(a, a), 0);
  EXPECT_LT(relative_difference(Vec4(0.001f), Vec4(0.002f)), 0.02f);
  EXPECT_EQ(relative_difference(a, Vec4(std::numeric_limits<float>::quiet_NaN())), 1);
  EXPECT_EQ(relative_difference(a, Vec4(kInfinity)), 1);
  EXPECT_EQ(relative_difference(Vec4(-1000), Vec4(1000)), 1);
}

TEST(Discrepancy, EveryInstructionSetFindsTheLargestDifferenceOfSinglePixels) {
  test::Random random(12);
  const float odd[] = {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(), -0.0f, 2e30f, 1e-40f};
  for (int n = 0; n < 2000; ++n) {
    std::array<Vec4, 16> a;
    std::array<Vec4, 4 * 7> b;
    for (Vec4& c : a) c = Vec4(random.uniform(-1, 4), random.uniform(0, 4), random.uniform(0, 4), random.uniform(0, 1));
    for (Vec4& c : b) c = Vec4(random.uniform(-1, 4), random.uniform(0, 4), random.uniform(0, 4), random.uniform(0, 1));
    for (int k = n % 3; k > 0; --k) a[static_cast<std::size_t>(random.integer(0, 15))][k] = odd[random.integer(0, 5)];
    const auto pixels = static_cast<BlockMask>(random.integer(0, 0xffff));
    float largest = 0.0f;
    for (std::size_t p = 0; p < 16; ++p) {
      if ((pixels >> p & 1) == 0) continue;
      largest = std::max(largest, relative_difference(a[p], b[p / 4 * 7 + p % 4]));
    }
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      ASSERT_EQ(largest_difference(a.data(), b.data(), 7, pixels), largest) << target << ", block " << n;
    }
  }
  force_simd_target("");
}

TEST(MultisampleResolve, FourSamplesAtOnceHaveTheBitsOfOneAfterTheOther) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> value(-2.0f, 8.0f);
  for (int n = 0; n < 500; ++n) {
    // No sample lies behind the last: an address sanitizer would notice.
    const std::unique_ptr<Vec3[]> color(new Vec3[4]);
    const std::unique_ptr<float[]> coverage(new float[4]);
    for (int k = 0; k < 4; ++k) {
      for (int c = 0; c < 3; ++c) color[k][c] = n % 5 == 0 ? -0.0f : value(random);
      coverage[k] = static_cast<float>(random() % 2);
    }
    const Vec4 expected = mean_of_samples(color.get(), coverage.get(), 4),
               got = mean_of_samples<4>(color.get(), coverage.get());
    ASSERT_EQ(std::memcmp(&got.x, &expected.x, 4 * sizeof(float)), 0) << n;
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      Vec4 on_lanes;
      means_of_row(color.get(), coverage.get(), 1, &on_lanes.x);
      ASSERT_EQ(std::memcmp(&on_lanes.x, &expected.x, 4 * sizeof(float)), 0) << target << ", " << n;
    }
  }
  force_simd_target("");
}

TEST(MultisampleResolve, ABlockHasTheMeansOfItsPixelsAndLeavesTheOthersAlone) {
  test::Random random(10);
  constexpr std::size_t kStride = 9;
  std::array<Vec3, 4 * 4 * kStride> color;
  std::array<float, 4 * 4 * kStride> coverage;
  for (Vec3& c : color) c = random.in_box(3);
  for (float& c : coverage) c = random.coin() ? 1.0f : 0.0f;
  for (int n = 0; n < 200; ++n) {
    const auto pixels = static_cast<std::uint16_t>(random.integer(0, 0xffff));
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      std::array<Vec4, 4 * kStride> out;
      out.fill(Vec4(-7.0f));
      means_of_block(color.data(), coverage.data(), kStride, pixels, out.data());
      for (std::size_t at = 0; at < out.size(); ++at) {
        const std::size_t x = at % kStride, y = at / kStride;
        const bool taken = x < 4 && (pixels >> (4 * y + x) & 1) != 0;
        ASSERT_EQ(out[at], taken ? mean_of_samples(&color[4 * at], &coverage[4 * at], 4) : Vec4(-7.0f)) << target;
      }
    }
  }
  force_simd_target("");
}

}  // namespace
}  // namespace tessera::tilecore::decisions_test
