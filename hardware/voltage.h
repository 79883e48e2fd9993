#pragma once

#include <span>

namespace tessera::hardware {

// Supply of the GPU by its clock, as voltage and frequency are scaled on a shipping part.
//
// The curve is that of the Mali-G57 of MediaTek's MT8192 (7 nm): the operating points that Linux drives it at
// (arch/arm64/boot/dts/mediatek/mt8192.dtsi), 358 to 866 MHz at 0.60625 to 0.8 V. A machine reaches
// voltage.nominal_mhz at the highest of them; at other clocks it has the voltage that the part has at the same
// fraction of its highest clock. Between points the voltage is linear. Below the lowest it stays: memories on chip
// need it. Above the highest it goes on as between 724 and 866 MHz, up to kMaxVolts; check_gpu refuses clocks beyond.
//
// Invariants (cited by the tests):
//   VF1  The voltage never falls with the clock, and at the nominal clock it is kNominalVolts.
//   VF2  A table's point has the table's voltage.
struct OperatingPoint {
  double mhz = 0, volts = 0;
};
std::span<const OperatingPoint> operating_points();  // from the lowest clock to the highest

inline constexpr double kNominalVolts = 0.8;
inline constexpr double kMaxVolts = 1.0;  // [assumed] what the process bears for years

// Both clocks positive. Defined beyond kMaxVolts as well.
double supply_volts(double clock_mhz, double nominal_mhz);
// The clock that needs kMaxVolts.
double max_clock_mhz(double nominal_mhz);

}  // namespace tessera::hardware
