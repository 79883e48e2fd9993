#include <gtest/gtest.h>

#include <set>

#include "base/error.h"
#include "base/random.h"
#include "base/simd_targets.h"

namespace tessera {
namespace {

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
