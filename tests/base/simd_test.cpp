#include <gtest/gtest.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <vector>

#include "base/error.h"
#include "base/random.h"
#include "base/real.h"
#include "base/simd_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/base/simd_test.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

// Writes the first lane's real_min and real_max.
void LeastAndLargest(float a, float b, float* out) {
  float lanes[hn::MaxLanes(FloatLanes::D())];
  real_min(FloatLanes(a), FloatLanes(b)).store(lanes);
  out[0] = lanes[0];
  real_max(FloatLanes(a), FloatLanes(b)).store(lanes);
  out[1] = lanes[0];
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace {

HWY_EXPORT(LeastAndLargest);

TEST(SimdTargets, LanesChooseTheOperandThatScalarsDo) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const std::vector<float> numbers = {0.0f, -0.0f, 1.0f, -1.0f, infinity, -infinity, nan, -nan};
  for (const std::string& name : simd_target_names()) {
    force_simd_target(name);
    for (const float a : numbers)
      for (const float b : numbers) {
        float out[2];
        HWY_DYNAMIC_DISPATCH(LeastAndLargest)(a, b, out);
        const auto bits = [](float f) { return std::bit_cast<std::uint32_t>(f); };
        EXPECT_EQ(bits(out[0]), bits(real_min(a, b))) << name << ": " << a << ", " << b;
        EXPECT_EQ(bits(out[1]), bits(real_max(a, b))) << name << ": " << a << ", " << b;
      }
  }
  force_simd_target("");
}

TEST(SimdTargets, ScalarCodeIsAlwaysThereAndTargetsCanBeForced) {
  const auto names = simd_target_names();
  ASSERT_FALSE(names.empty());
  EXPECT_TRUE(names.back() == "SCALAR" || names.back() == "EMU128") << names.back();
  for (const std::string& name : names) {
    force_simd_target(name);
    EXPECT_EQ(simd_target_name(), name);
  }
  force_simd_target("");
  EXPECT_EQ(simd_target_name(), names.front());
  EXPECT_THROW(force_simd_target("ABACUS"), UsageError);
}

TEST(Random, Mix32IsABijectionOnEverySampledBlock) {
  std::set<std::uint32_t> seen;
  for (std::uint32_t i = 0; i < 100000; ++i) seen.insert(mix32(i * 2654435761u));
  EXPECT_EQ(seen.size(), 100000u);
}

TEST(Random, ReversedBitsAndSobolFormATwoDimensionalNet) {
  // A (0,2)-sequence: every elementary interval of area 1/16 holds one of the first 16 points.
  for (int log_x = 0; log_x <= 4; ++log_x) {
    std::set<std::uint32_t> cells;
    for (std::uint32_t i = 0; i < 16; ++i) {
      const std::uint32_t x = log_x == 0 ? 0 : reverse_bits32(i) >> (32 - log_x),
                          y = log_x == 4 ? 0 : sobol2_32(i) >> (28 + log_x);
      cells.insert(x << 8 | y);
    }
    EXPECT_EQ(cells.size(), 16u) << log_x;
  }
}

}  // namespace
}  // namespace tessera
#endif
