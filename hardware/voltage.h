#pragma once

#include <span>

namespace tessera::hardware {

// Supply voltage of the GPU by its clock, scaled as on a shipping part.
//
// The curve is taken from the Mali-G57 of MediaTek's MT8192 (7 nm): the operating points in Linux
// (arch/arm64/boot/dts/mediatek/mt8192.dtsi), 358 to 866 MHz at 0.60625 to 0.8 V. A machine reaches voltage.nominal_mhz
// at the highest point; at other clocks it has the part's voltage at the same fraction of its highest clock. The
// voltage is linear between points. It is constant below the lowest point, as memories on chip need it, and above the
// highest one it continues the slope between 724 and 866 MHz up to kMaxVolts; check_gpu refuses clocks beyond.
//
// Invariants (cited by the tests):
//   VF1  The voltage never falls with the clock, and at the nominal clock it is kNominalVolts.
//   VF2  A table's point has the table's voltage.
struct OperatingPoint {
  double mhz = 0, volts = 0;
};
std::span<const OperatingPoint> operating_points();  // from the lowest clock to the highest

inline constexpr double kNominalVolts = 0.8;
inline constexpr double kMaxVolts = 1.0;  // [assumed] the process survives this voltage for years

// Both clocks must be positive. Clocks beyond kMaxVolts are allowed.
double supply_volts(double clock_mhz, double nominal_mhz);
// The clock that needs kMaxVolts.
double max_clock_mhz(double nominal_mhz);

}  // namespace tessera::hardware
