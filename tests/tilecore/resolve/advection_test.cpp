#include <rapidcheck/gtest.h>

#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/resolve/window.h"
#include "tilecore/resolve/advection.h"

namespace tessera::tilecore::advection_test {
namespace {

using windows::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

// Two frames of the same size, everything at depth 10 and of patch 7 until it is changed.
struct Frames {
  static constexpr int kSide = 24;
  IntRect region;
  std::vector<Vec4> color = std::vector<Vec4>(kSide * kSide);
  std::vector<float> depth = std::vector<float>(kSide * kSide, 10.0f);
  std::vector<std::uint32_t> patch = std::vector<std::uint32_t>(kSide * kSide, 7u);
  std::vector<Vec2> velocity = std::vector<Vec2>(kSide * kSide, Vec2(0.0f));
  std::vector<std::uint8_t> usable = std::vector<std::uint8_t>(kSide * kSide, std::uint8_t{1});
  AdvectionWork work;
  float slope = 0;

  explicit Frames(int x0 = 0, int y0 = 0) : region{x0, y0, x0 + kSide, y0 + kSide} {
    Random random(11);
    for (Vec4& c : color) c = windows::random_color(random);
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>((y - region.y0) * kSide + x - region.x0); }
  Vec4& color_at(int x, int y) { return color[index(x, y)]; }
  void paint(const std::function<double(double, double)>& value) {
    for (int y = region.y0; y < region.y1; ++y)
      for (int x = region.x0; x < region.x1; ++x) color_at(x, y) = Vec4(static_cast<float>(value(x, y)));
  }
  void move(const std::function<Vec2(double, double)>& v) {
    for (int y = region.y0; y < region.y1; ++y)
      for (int x = region.x0; x < region.x1; ++x) velocity[index(x, y)] = v(x, y);
  }
  AdvectedPixel advect(int x, int y, const AdvectionSettings& settings = {}, float z = 10.0f, std::uint32_t id = 7) {
    return advect_pixel(x, y, z, id, {color.data(), depth.data(), patch.data(), region, kSide},
                        {velocity.data(), usable.data(), region, kSide}, settings, slope, work);
  }
};

const AdvectionSettings kEverySetting[] = {{Fetch::kBilinear, false},
                                           {Fetch::kBilinear, true},
                                           {Fetch::kBicubic, false},
                                           {Fetch::kBicubic, true},
                                           {Fetch::kBicubic, true, false}};

bool same_bits(const Vec4& a, const Vec4& b) { return std::memcmp(&a.x, &b.x, sizeof(float) * 4) == 0; }

TEST(Advection, StandingStillIsACopyBitForBit) {  // ADV1
  for (const AdvectionSettings& settings : kEverySetting)
    for (const float zero : {0.0f, -0.0f}) {
      Frames frames;
      frames.move([&](double, double) { return Vec2(zero); });
      // Zeros of either sign, denormals and the largest float; the neighbours would all be refused.
      frames.color_at(5, 6) = Vec4(-0.0f, 1e-42f, std::numeric_limits<float>::max(), 0.1f);
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 24; ++x)
          if (x != 5 || y != 6) frames.patch[frames.index(x, y)] = 8;
      const AdvectedPixel got = frames.advect(5, 6, settings);
      ASSERT_EQ(got.outcome, Advection::kTaken);
      EXPECT_TRUE(same_bits(got.color, frames.color_at(5, 6)));
      EXPECT_EQ(frames.work.history_texels, 1u);
      EXPECT_EQ(frames.work.fetches, 1u);
      EXPECT_EQ(frames.work.velocity_texels, settings.bfecc ? 2u : 1u);
      EXPECT_EQ(frames.work.bilinear_fallbacks, 0u);
    }
}

TEST(Advection, WholePixelsOfMotionCopyToo) {  // ADV2
  for (const AdvectionSettings& settings : kEverySetting)
    for (const auto& [dx, dy] : {std::pair{3, 0}, {-2, 1}, {0, -4}, {4, 4}}) {
      Frames frames;
      frames.move([&, x = dx, y = dy](double, double) { return Vec2(static_cast<float>(x), static_cast<float>(y)); });
      const AdvectedPixel got = frames.advect(10, 12, settings);
      ASSERT_EQ(got.outcome, Advection::kTaken);
      EXPECT_TRUE(same_bits(got.color, frames.color_at(10 - dx, 12 - dy)));
      EXPECT_EQ(frames.work.history_texels, 1u);
    }
}

TEST(Advection, TheSameMotionGivesTheSameBitsAnywhereInTheFrame) {  // ADV3
  for (const AdvectionSettings& settings : kEverySetting) {
    Frames near(0, 0), far(7000, 3000);
    Random random(4);
    for (int i = 0; i < 200; ++i) {
      const Vec2 v(windows::uniform(random, -3, 3), windows::uniform(random, -3, 3));
      near.move([&](double, double) { return v; });
      far.move([&](double, double) { return v; });
      EXPECT_TRUE(same_bits(near.advect(12, 12, settings).color, far.advect(7012, 3012, settings).color));
    }
  }
  // The failing twin: fractions of positions are coarser far from the corner.
  const float v = 0.3f;
  EXPECT_NE((12 - v) - std::floor(12 - v), (7012 - v) - std::floor(7012 - v));
}

TEST(Advection, ATinyMotionIsNotAWholePixel) {
  Frames frames;
  frames.paint([](double x, double y) { return x + 10 * y; });
  for (const float tiny : {1e-20f, -1e-20f, 1e-8f, -1e-8f, 1e-30f}) {
    frames.move([&](double, double) { return Vec2(tiny, -tiny); });
    for (const AdvectionSettings& settings : kEverySetting) {
      const AdvectedPixel got = frames.advect(12, 12, settings);
      ASSERT_EQ(got.outcome, Advection::kTaken);
      EXPECT_NEAR(got.color.x, 132.0f, 1e-4f);
    }
  }
}

RC_GTEST_PROP(Advection, FetchesAreTheInterpolationsInDoublePrecision, (std::uint32_t seed)) {
  Random random(seed);
  Frames frames;
  const Vec2 v(windows::uniform(random, -5, 5), windows::uniform(random, -5, 5));
  frames.move([&](double, double) { return v; });
  const double px = 12 - static_cast<double>(v.x), py = 12 - static_cast<double>(v.y);
  const auto weight = [](double d, bool cubic) {
    d = std::abs(d);
    if (!cubic) return std::max(0.0, 1 - d);
    return d < 1 ? 1.5 * d * d * d - 2.5 * d * d + 1 : d < 2 ? -0.5 * d * d * d + 2.5 * d * d - 4 * d + 2 : 0.0;
  };
  for (const bool cubic : {false, true}) {
    DVec4 expected(0.0);
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 24; ++x)
        expected += weight(x - px, cubic) * weight(y - py, cubic) * DVec4(frames.color_at(x, y));
    frames.work = {};
    const AdvectedPixel got = frames.advect(12, 12, {cubic ? Fetch::kBicubic : Fetch::kBilinear, false, false});
    RC_ASSERT(got.outcome == Advection::kTaken);
    for (int c = 0; c < 4; ++c)
      RC_ASSERT(std::abs(static_cast<double>(got.color[c]) - expected[c]) < 1e-5 * (c == 2 ? 1000 : 4));
    // A fraction near 0 or 1 leaves outer texels without a weight.
    RC_ASSERT(frames.work.history_texels <= (cubic ? 16u : 4u) && frames.work.history_texels >= (cubic ? 9u : 4u));
  }
}

TEST(Advection, BetweenFourTexelsThatAgreeATentWeighsThem) {
  Random random(23);
  std::uniform_real_distribution<float> uniform(0.01f, 0.99f);
  for (int i = 0; i < 500; ++i) {
    Frames frames;
    const float fx = uniform(random), fy = uniform(random);
    frames.move([&](double, double) { return Vec2(3.0f - fx, -2.0f - fy); });
    const AdvectedPixel got = frames.advect(9, 9);
    ASSERT_EQ(got.outcome, Advection::kTaken);
    EXPECT_EQ(frames.work.history_texels, 4u);
    for (int c = 0; c < 4; ++c) {
      const auto at = [&](int dx, int dy) { return static_cast<double>(frames.color_at(6 + dx, 11 + dy)[c]); };
      const double u = static_cast<double>(fx), v = static_cast<double>(fy),
                   expected = (1 - u) * (1 - v) * at(0, 0) + u * (1 - v) * at(1, 0) + (1 - u) * v * at(0, 1) +
                              u * v * at(1, 1);
      EXPECT_NEAR(got.color[c], expected, 1e-5 * (1 + std::abs(expected)));
    }
  }
}

TEST(Advection, AFlatHistoryStaysFlat) {
  Frames frames;
  frames.paint([](double, double) { return 0.1; });
  frames.move([](double, double) { return Vec2(0.37f, -1.61f); });
  for (const AdvectionSettings& settings : kEverySetting) EXPECT_EQ(frames.advect(12, 12, settings).color, Vec4(0.1f));
}

TEST(Advection, TheClampKeepsABicubicFetchFromOvershooting) {
  Frames frames;
  frames.paint([](double x, double) { return x < 12 ? 0.0 : 1.0; });
  frames.move([](double, double) { return Vec2(0.5f, 0.0f); });
  EXPECT_LT(frames.advect(11, 12, {Fetch::kBicubic, false, false}).color.x, 0.0f);  // halfway between 10 and 11
  EXPECT_EQ(frames.advect(11, 12, {Fetch::kBicubic, false, true}).color.x, 0.0f);
}

// ---- Refusals -------------------------------------------------------------------------------------------------------

TEST(Advection, APlaceOutsideOfTheFrameIsRefusedHoweverFar) {
  for (const AdvectionSettings& settings : kEverySetting)
    for (const Vec2& v : {Vec2(12.5f, 0), Vec2(-12.5f, 0), Vec2(0, 12.25f), Vec2(0, -11.5f), Vec2(1e9f, 0),
                          Vec2(-3e38f, 3e38f), Vec2(0, -5e6f)}) {
      Frames frames;
      frames.move([&](double, double) { return v; });
      EXPECT_EQ(frames.advect(12, 12, settings).outcome, Advection::kOutsideFrame) << v.x << " " << v.y;
    }
  // The last place inside: texels 0 and 23 are the frame's.
  Frames frames;
  frames.move([](double x, double) { return Vec2(x < 12 ? 0.5f : -0.5f, 0.0f); });
  EXPECT_EQ(frames.advect(1, 12).outcome, Advection::kTaken);
  EXPECT_EQ(frames.advect(22, 12).outcome, Advection::kTaken);
  EXPECT_EQ(frames.advect(0, 12).outcome, Advection::kOutsideFrame);
  EXPECT_EQ(frames.advect(23, 12).outcome, Advection::kOutsideFrame);
}

TEST(Advection, UnusableAndNonFiniteVelocitiesAreRefused) {
  for (const AdvectionSettings& settings : kEverySetting) {
    Frames frames;
    frames.usable[frames.index(12, 12)] = 0;
    EXPECT_EQ(frames.advect(12, 12, settings).outcome, Advection::kUnusableVelocity);
    EXPECT_EQ(frames.work.history_texels, 0u);
    for (const float bad : {kNan, kInfinity, -kInfinity})
      for (int c = 0; c < 2; ++c) {
        frames.velocity[frames.index(11, 12)] = Vec2(0.0f);
        frames.velocity[frames.index(11, 12)][c] = bad;
        EXPECT_EQ(frames.advect(11, 12, settings).outcome, Advection::kUnusableVelocity);
      }
  }
}

TEST(Advection, EveryTexelWithAWeightMustShowTheSameSurface) {  // ADV4
  const auto spoil = [](Frames& frames, int x, int y, Advection how) {
    const std::size_t at = frames.index(x, y);
    if (how == Advection::kOtherPatch) frames.patch[at] = 8;
    if (how == Advection::kDisoccluded) frames.depth[at] = 10.3f;
    if (how == Advection::kNonFinite) frames.color[at].z = kNan;
  };
  for (const Advection how : {Advection::kOtherPatch, Advection::kDisoccluded, Advection::kNonFinite})
    for (const Fetch fetch : {Fetch::kBilinear, Fetch::kBicubic})
      for (int j = -1; j <= 2; ++j)
        for (int i = -1; i <= 2; ++i) {
          Frames frames;
          frames.move([](double, double) { return Vec2(0.25f, 0.75f); });
          const AdvectedPixel before = frames.advect(12, 12, {Fetch::kBilinear});
          spoil(frames, 11 + i, 11 + j, how);  // the place is (11.75, 11.25)
          frames.work = {};
          const AdvectedPixel got = frames.advect(12, 12, {fetch});
          const bool inner = (i == 0 || i == 1) && (j == 0 || j == 1);
          EXPECT_EQ(got.outcome, inner ? how : Advection::kTaken);
          EXPECT_EQ(frames.work.bilinear_fallbacks, fetch == Fetch::kBicubic && !inner ? 1u : 0u);
          if (!inner) {
            EXPECT_EQ(got.color, before.color);
          }
        }
}

TEST(Advection, DepthsAgreeWithinAShareOfThePixelsOwn) {
  Frames frames;
  for (const float z : {1e-3f, 1.0f, 1e6f})
    for (const float slope : {0.0f, 0.005f})
      for (const float share : {0.0019f, -0.0019f, 0.0021f, -0.0021f, 0.0069f, -0.0069f, 0.0071f}) {
        frames.slope = slope * z;
        frames.depth[frames.index(12, 12)] = z * (1 + share);
        EXPECT_EQ(frames.advect(12, 12, {}, z).outcome,
                  std::abs(share) < 0.002f + slope ? Advection::kTaken : Advection::kDisoccluded);
      }
  for (const float there : {10.0f, kInfinity, kNan}) {
    frames.depth[frames.index(12, 12)] = there;
    EXPECT_EQ(frames.advect(12, 12, {}, kInfinity).outcome,
              there == kInfinity ? Advection::kTaken : Advection::kDisoccluded);
    EXPECT_EQ(frames.advect(12, 12, {}, kNan).outcome, Advection::kDisoccluded);
    EXPECT_EQ(frames.advect(12, 12, {}, 10.0f).outcome, there == 10.0f ? Advection::kTaken : Advection::kDisoccluded);
  }
}

// ---- Back and forth -------------------------------------------------------------------------------------------------

constexpr double kMiddle = 11.5;

// How far from where it was one frame ago a pixel of a plane that turns by `angle` is looked for. The image is a
// ramp, so the colour is the place.
double miss(bool bfecc, double angle, const std::function<Vec2(double, double)>& velocity) {
  double worst = 0;
  for (const bool along_x : {true, false}) {
    Frames frames;
    frames.paint([&](double x, double y) { return along_x ? x : y; });
    frames.move(velocity);
    for (int y = 8; y < 16; ++y)
      for (int x = 8; x < 16; ++x) {
        const AdvectedPixel got = frames.advect(x, y, {Fetch::kBilinear, bfecc});
        EXPECT_EQ(got.outcome, Advection::kTaken);
        const double dx = x - kMiddle, dy = y - kMiddle;
        const double back = along_x ? kMiddle + dx * std::cos(angle) + dy * std::sin(angle)
                                    : kMiddle - dx * std::sin(angle) + dy * std::cos(angle);
        worst = std::max(worst, std::abs(static_cast<double>(got.color.x) - back));
      }
  }
  return worst;
}

TEST(Advection, BackAndForthIsSecondOrderForVelocitiesOfAnInstant) {
  const auto instant = [](double angle) {
    return [angle](double x, double y) {
      return Vec2(static_cast<float>(-angle * (y - kMiddle)), static_cast<float>(angle * (x - kMiddle)));
    };
  };
  for (const double angle : {0.1, 0.05}) {
    const double plain = miss(false, angle, instant(angle)), corrected = miss(true, angle, instant(angle));
    EXPECT_LT(corrected, 0.1 * plain) << angle;
    RecordProperty("corrected_over_plain_at_" + std::to_string(angle), std::to_string(corrected / plain));
  }
  // Orders: halving the step quarters the plain error and cuts the corrected one by eight.
  EXPECT_NEAR(miss(false, 0.1, instant(0.1)) / miss(false, 0.05, instant(0.05)), 4, 0.5);
  EXPECT_NEAR(miss(true, 0.1, instant(0.1)) / miss(true, 0.05, instant(0.05)), 8, 1);
}

// Velocities from the vertices of both frames are displacements: the way back is exact without a correction, and
// the correction moves it off by half of the change of the velocity in one step.
TEST(Advection, BackAndForthHarmsWhereTheVelocityIsTheExactDisplacement) {
  for (const double angle : {0.1, 0.05}) {
    const auto displacement = [&](double x, double y) {
      const double dx = x - kMiddle, dy = y - kMiddle;
      return Vec2(static_cast<float>(dx - (dx * std::cos(angle) + dy * std::sin(angle))),
                  static_cast<float>(dy - (-dx * std::sin(angle) + dy * std::cos(angle))));
    };
    EXPECT_LT(miss(false, angle, displacement), 1e-5);
    EXPECT_NEAR(miss(true, angle, displacement), 0.5 * angle * angle * 3.5, 0.3 * angle * angle * 3.5);
  }
}

TEST(Advection, WithoutAVelocityAtTheFarEndThereIsNoCorrection) {
  Frames frames;
  frames.move([](double x, double) { return Vec2(x > 11 ? 2.0f : 1.0f, 0.0f); });
  frames.usable[frames.index(10, 12)] = 0;
  const AdvectedPixel got = frames.advect(12, 12, {Fetch::kBilinear, true});
  EXPECT_EQ(got.outcome, Advection::kTaken);
  EXPECT_EQ(got.color, frames.color_at(10, 12));
  EXPECT_EQ(frames.work.uncorrected, 1u);
  frames.usable[frames.index(10, 12)] = 1;
  EXPECT_NE(frames.advect(12, 12, {Fetch::kBilinear, true}).color, frames.color_at(10, 12));
}

// For any input, whole blocks take the same colours as pixel by pixel, and no plain block is refused.
RC_GTEST_PROP(Advection, WholeBlocksHaveTheBitsOfSinglePixels, (std::uint32_t seed)) {
  Random random(seed);
  const std::vector<std::string> targets = simd_target_names();
  Frames frames(windows::below(random, 9), windows::below(random, 9));
  const float reach = windows::below(random, 2) ? 2.0f : 14.0f;  // within, and out of the region
  const Vec2 way(windows::uniform(random, -reach, reach), windows::uniform(random, -reach, reach));
  frames.move([&](double, double) {
    return way + Vec2(windows::uniform(random, -0.1f, 0.1f), windows::uniform(random, -0.1f, 0.1f));
  });
  const float odd[] = {0.0f, -0.0f, 3.0f, -1e-30f, 0x1p21f, kNan, kInfinity};
  for (int k = 0; k < 40; ++k) {
    const auto at = static_cast<std::size_t>(windows::below(random, 24 * 24)),
               there = static_cast<std::size_t>(windows::below(random, 24 * 24));
    switch (windows::below(random, 5)) {
      case 0:
        frames.velocity[at][windows::below(random, 2)] = odd[windows::below(random, 7)];
        break;
      case 1:
        frames.usable[at] = 0;
        break;
      case 2:
        frames.patch[there] = 8;
        break;
      case 3:
        frames.depth[there] = windows::below(random, 2) ? kInfinity : 10.5f;
        break;
      default:
        frames.color[there][windows::below(random, 4)] = windows::below(random, 2) ? kNan : kInfinity;
    }
  }
  const int x0 = frames.region.x0 + 4 + windows::below(random, 16),
            y0 = frames.region.y0 + 4 + windows::below(random, 16);
  const std::vector<float> depth(24 * 24, 10.0f);
  const std::vector<std::uint32_t> patch(24 * 24, 7u);
  const std::size_t first = frames.index(x0, y0);
  const BlockOfPixels block{
      x0, y0, &depth[first], &patch[first], &frames.velocity[first], &frames.usable[first], Frames::kSide};
  const auto wanted = static_cast<std::uint16_t>(random());
  std::array<Vec4, 16> got;
  got.fill(Vec4(-77.0f));
  AdvectionWork work;
  force_simd_target(targets[seed % targets.size()]);
  const PlainAdvection plain = advect_plain_pixels(
      block, wanted, {frames.color.data(), frames.depth.data(), frames.patch.data(), frames.region, Frames::kSide},
      frames.slope, got.data(), 4, work);
  force_simd_target("");
  RC_ASSERT((plain.taken & ~wanted) == 0);
  AdvectionWork expected_work;
  for (int p = 0; p < 16; ++p) {
    frames.work = {};
    const AdvectedPixel expected = frames.advect(x0 + p % 4, y0 + p / 4);
    const bool taken = (plain.taken >> p & 1) != 0,
               between_four = expected.outcome == Advection::kTaken && frames.work.history_texels == 4;
    RC_ASSERT(taken == (between_four && (wanted >> p & 1) != 0));
    const bool right = taken ? same_bits(got[static_cast<std::size_t>(p)], expected.color)
                             : got[static_cast<std::size_t>(p)] == Vec4(-77.0f);
    RC_ASSERT(right);
    if (taken) expected_work.history_texels += 4, expected_work.fetches += 1;
  }
  RC_ASSERT(work.history_texels == expected_work.history_texels && work.fetches == expected_work.fetches);
  if (plain.taken != 0) RC_ASSERT(frames.region.intersect(plain.texels) == plain.texels);
}

}  // namespace
}  // namespace tessera::tilecore::advection_test
