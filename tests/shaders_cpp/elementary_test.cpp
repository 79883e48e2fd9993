// Exponential and logarithm of the shaders, against the C library's in double precision.
#include "shaders_cpp/elementary.h"
#include "tests/support/tests.h"

namespace tessera::shaders::elementary_test {
namespace {

// Distance to the truth in units of the last place of the float nearest to it.
double ulps(float value, double truth) {
  const float nearest = static_cast<float>(truth);
  const double unit = static_cast<double>(std::nextafter(std::abs(nearest), std::numeric_limits<float>::infinity()) -
                                          std::abs(nearest));
  return std::abs(static_cast<double>(value) - truth) / unit;
}

// `step`: of the numbers that floats have.
template <class Check>
void over_floats(float from, float to, std::uint32_t step, const Check& check) {
  for (std::uint32_t bits = std::bit_cast<std::uint32_t>(from); bits <= std::bit_cast<std::uint32_t>(to); bits += step)
    check(std::bit_cast<float>(bits));
}

TEST(Elementary, ExponentialIsWithinTwoUnits) {
  double worst = 0;
  const auto check = [&](float x) { worst = std::max(worst, ulps(real_exp(x), std::exp(static_cast<double>(x)))); };
  over_floats(1e-30f, 88.0f, 997, check);
  over_floats(1e-30f, 87.0f, 997, [&](float x) { check(-x); });
  EXPECT_LT(worst, 2.0);
  EXPECT_EQ(real_exp(0.0f), 1.0f);
  EXPECT_EQ(real_exp(-1e30f), real_exp(-87.0f));
  EXPECT_TRUE(std::isfinite(real_exp(1e30f)));
}

TEST(Elementary, LogarithmIsWithinTwoUnits) {
  double worst = 0;
  const auto check = [&](float x) { worst = std::max(worst, ulps(real_log2(x), std::log2(static_cast<double>(x)))); };
  over_floats(std::numeric_limits<float>::min(), std::numeric_limits<float>::max(), 1499, check);
  over_floats(0.7f, 1.5f, 7, check);  // where it is near zero
  EXPECT_LT(worst, 2.0);
  for (int n = -100; n <= 100; ++n) EXPECT_EQ(real_log2(std::ldexp(1.0f, n)), static_cast<float>(n));
}

TEST(Elementary, CosineIsWithinAMillionth) {
  double worst = 0;
  for (int n = -1000000; n <= 1000000; ++n) {
    const float x = static_cast<float>(n) * 1e-3f;
    worst = std::max(worst, std::abs(static_cast<double>(real_cos(x)) - std::cos(static_cast<double>(x))));
  }
  EXPECT_LT(worst, 1e-6);
  EXPECT_EQ(real_cos(0.0f), 1.0f);
}

// A broken twin: the same series without the second part of log(2) is not within two units.
TEST(Elementary, TheCheckSeesAnExponentialWithASingleConstant) {
  double worst = 0;
  over_floats(1.0f, 80.0f, 99991, [&](float x) {
    const float whole = std::floor(x * 1.44269504f + 0.5f), r = x - whole * 0.693147181f;
    worst = std::max(worst,
                     ulps(static_cast<float>(std::exp(static_cast<double>(r)) * std::exp2(static_cast<double>(whole))),
                          std::exp(static_cast<double>(x))));
  });
  EXPECT_GT(worst, 2.0);
}

}  // namespace
}  // namespace tessera::shaders::elementary_test
