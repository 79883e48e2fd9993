// The supply of the GPU by its clock.
#include "hardware/voltage.h"
#include "tests/support/tests.h"

namespace tessera::hardware::voltage_test {
namespace {

TEST(Voltage, NeverFallsWithTheClockAndIsNominalAtTheNominalClock) {  // VF1
  for (const double nominal : {400.0, 850.0, 1300.0}) {
    EXPECT_DOUBLE_EQ(supply_volts(nominal, nominal), kNominalVolts);
    double before = 0;
    for (double share = 0.05; share < 3; share += 0.001) {
      const double volts = supply_volts(share * nominal, nominal);
      EXPECT_GE(volts, before) << share;
      before = volts;
    }
    EXPECT_GT(before, kMaxVolts);
  }
}

TEST(Voltage, EqualsTheTableAtItsPointsAndLiesBetweenItsNeighboursElsewhere) {  // VF2
  const auto points = operating_points();
  const double highest = points.back().mhz;
  for (std::size_t p = 0; p < points.size(); ++p) {
    EXPECT_NEAR(supply_volts(points[p].mhz, highest), points[p].volts, 1e-12);
    if (p == 0) continue;
    const double between = supply_volts((points[p - 1].mhz + points[p].mhz) / 2, highest);
    EXPECT_NEAR(between, (points[p - 1].volts + points[p].volts) / 2, 1e-12);
  }
  // The same fraction of another nominal clock.
  EXPECT_NEAR(supply_volts(points[3].mhz / 2, highest / 2), points[3].volts, 1e-12);
}

TEST(Voltage, StaysBelowTheTableAndGoesOnAboveItUpToTheProcessLimit) {
  EXPECT_EQ(supply_volts(1, 850), operating_points().front().volts);
  const double most = max_clock_mhz(850);
  EXPECT_NEAR(supply_volts(most, 850), kMaxVolts, 1e-12);
  EXPECT_GT(most, 1200);
  EXPECT_LT(most, 1300);
}

}  // namespace
}  // namespace tessera::hardware::voltage_test
