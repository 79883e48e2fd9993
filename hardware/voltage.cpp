#include "hardware/voltage.h"

#include <array>
#include <cstddef>

namespace tessera::hardware {
namespace {

// [spec] Linux, mt8192.dtsi, gpu_opp_table.
constexpr std::array<OperatingPoint, 16> kPoints = {{{358, 0.60625},
                                                     {399, 0.61875},
                                                     {440, 0.63125},
                                                     {482, 0.64375},
                                                     {523, 0.65625},
                                                     {564, 0.66875},
                                                     {605, 0.68125},
                                                     {647, 0.69375},
                                                     {688, 0.70625},
                                                     {724, 0.725},
                                                     {748, 0.7375},
                                                     {772, 0.75},
                                                     {795, 0.7625},
                                                     {819, 0.775},
                                                     {843, 0.7875},
                                                     {866, 0.8}}};
static_assert(kPoints.back().volts == kNominalVolts);
constexpr double kSlope = (kPoints.back().volts - kPoints[9].volts) / (kPoints.back().mhz - kPoints[9].mhz);

}  // namespace

std::span<const OperatingPoint> operating_points() { return kPoints; }

double supply_volts(double clock_mhz, double nominal_mhz) {
  const double mhz = clock_mhz / nominal_mhz * kPoints.back().mhz;
  if (mhz <= kPoints.front().mhz) return kPoints.front().volts;
  if (mhz >= kPoints.back().mhz) return kNominalVolts + kSlope * (mhz - kPoints.back().mhz);
  std::size_t above = 1;
  while (kPoints[above].mhz < mhz) ++above;
  const OperatingPoint &low = kPoints[above - 1], &high = kPoints[above];
  return low.volts + (high.volts - low.volts) * ((mhz - low.mhz) / (high.mhz - low.mhz));
}

double max_clock_mhz(double nominal_mhz) {
  return nominal_mhz * (1 + (kMaxVolts - kNominalVolts) / kSlope / kPoints.back().mhz);
}

}  // namespace tessera::hardware
