// Stencils between half pixels of supersampled blocks.
#include "tilecore/resolve/half_pixel_stencil.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::half_pixel_stencil_test {
namespace {

constexpr std::uint32_t kFrames[] = {0, 1, 2, 3, 17, 0xfffffffe, 0xffffffff};

TEST(HalfPixelStencil, PatternsHaveTheirSizeAndVisitEveryPlaceAsOften) {  // HS1
  for (const int groups : {16, 24, 32})
    for (const std::uint32_t first : kFrames) {
      EXPECT_EQ(std::popcount(half_pattern(groups, first)), groups);
      EXPECT_EQ(half_pattern(groups, first) | half_pattern(groups, first + 1), kAllHalves);
      for (int place = 0; place < 32; ++place) {
        int rendered = 0;
        for (std::uint32_t f = 0; f < 4; ++f) rendered += half_pattern(groups, first + f) >> place & 1;
        EXPECT_EQ(rendered, groups / 8);
      }
    }
}

// The definition, in the plainest way.
double cubic(double x) {
  x = std::abs(x);
  const double b = 1.0 / 3, c = 1.0 / 3;
  if (x < 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + 6 - 2 * b) / 6;
  if (x < 2) return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + 8 * b + 24 * c) / 6;
  return 0;
}
double weight(int dx, int dy) {
  const double s = std::sqrt(8.0) / 3;
  return std::abs(dx) > 2 || std::abs(dy) > 2 ? 0 : cubic(s * dx / 2) * cubic(s * dy);
}
double sum_of_weights(HalfMask usable, int place) {
  double sum = 0;
  for (int other = 0; other < 32; ++other)
    if (usable >> other & 1) sum += weight(other % 8 - place % 8, other / 8 - place / 8);
  return sum;
}

TEST(HalfPixelStencil, WeightsAreWithinAUnitOfTheDefinitionAndSumToAPowerOfTwo) {  // HS2
  int stencils = 0;
  std::size_t most = 0;
  for (const int groups : {16, 24})
    for (std::uint32_t frame = 0; frame < 4; ++frame) {
      const HalfMask pattern = half_pattern(groups, frame);
      for (int place = 0; place < 32; ++place) {
        const auto s = half_stencil(pattern, place);
        ASSERT_EQ(s.has_value(), (pattern >> place & 1) == 0);
        if (!s) continue;
        ++stencils;
        most = std::max(most, s->count);
        EXPECT_TRUE(std::has_single_bit(static_cast<unsigned>(s->unit()))) << s->unit();
        const double sum = sum_of_weights(pattern, place);
        for (std::size_t i = 0; i < s->count; ++i) {
          const StencilTap& t = s->taps[i];
          const int x = place % 8 + t.dx, y = place / 8 + t.dy;
          ASSERT_TRUE(x >= 0 && x < 8 && y >= 0 && y < 4);
          EXPECT_TRUE(pattern >> (8 * y + x) & 1);
          EXPECT_LT(std::abs(t.weight - weight(t.dx, t.dy) / sum * s->unit()), 1);
          EXPECT_TRUE(t.weight >= -128 && t.weight <= 127 && t.dx >= -3 && t.dx <= 3);
        }
      }
    }
  EXPECT_EQ(stencils, 4 * 16 + 4 * 8);
  EXPECT_LE(most, 14u);
}

TEST(HalfPixelStencil, AFlatColourIsExactAndARampIsCloseAwayFromTheBordersOfTheBlock) {  // HS3
  std::array<Vec3, 32> flat, ramp;
  flat.fill(Vec3(0.1f, 1e-7f, 1234.5f));
  for (int place = 0; place < 32; ++place)
    ramp[static_cast<std::size_t>(place)] =
        Vec3(static_cast<float>(place % 8) * 0.5f, static_cast<float>(place / 8), 1.0f);
  test::Random random(5);
  for (const int groups : {16, 24})
    for (std::uint32_t frame = 0; frame < 4; ++frame)
      for (int n = 0; n < 200; ++n) {
        const HalfMask pattern = half_pattern(groups, frame);
        const int place = random.integer(0, 31);
        if (pattern >> place & 1) continue;
        const HalfMask holes = n % 2 == 0 ? kAllHalves : static_cast<HalfMask>(random.integer(0, 0x7fffffff));
        const HalfMask usable = pattern & holes;
        if (!half_is_reconstructible(usable, place)) {
          EXPECT_NE(n % 2, 0);
          continue;
        }
        std::uint64_t taps = 0;
        EXPECT_EQ(reconstruct_half(pattern, usable, place, flat.data(), taps), flat[0]);
        EXPECT_GE(taps, 1u);
        if (holes != kAllHalves || place % 8 < 2 || place % 8 > 5 || place / 8 < 1 || place / 8 > 2) continue;
        const Vec3 got = reconstruct_half(pattern, usable, place, ramp.data(), taps);
        EXPECT_NEAR(got.x, ramp[static_cast<std::size_t>(place)].x, 0.03f);
        EXPECT_NEAR(got.y, ramp[static_cast<std::size_t>(place)].y, 0.1f);
      }
}

// What is not usable has no influence, whatever it holds; without anything near there is nothing.
TEST(HalfPixelStencil, UnusablePlacesAreNotRead) {
  std::array<Vec3, 32> colors;
  colors.fill(Vec3(std::numeric_limits<float>::quiet_NaN()));
  const HalfMask pattern = half_pattern(16, 0);
  const int place = 10;
  ASSERT_FALSE(pattern >> place & 1);
  EXPECT_FALSE(half_is_reconstructible(0, place));
  EXPECT_FALSE(half_is_reconstructible(1u << 31, place));
  const HalfMask usable = 1u << 9 | 1u << 11;
  ASSERT_EQ(pattern & usable, usable);
  colors[9] = Vec3(1.0f), colors[11] = Vec3(3.0f);
  std::uint64_t taps = 0;
  const Vec3 got = reconstruct_half(pattern, usable, place, colors.data(), taps);
  EXPECT_NEAR(got.x, 2.0f, 1e-6f);
  EXPECT_EQ(taps, 2u);
}

}  // namespace
}  // namespace tessera::tilecore::half_pixel_stencil_test
