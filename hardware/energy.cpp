#include "hardware/energy.h"

#include <algorithm>
#include <cmath>

#include "hardware/stage.h"
#include "hardware/voltage.h"

namespace tessera::hardware {

double FrameEnergy::total_nj() const {
  double sum = 0;
  for (const auto& [unit, nj] : by_unit_nj) sum += nj;
  return sum;
}

void FrameEnergy::accumulate(const FrameEnergy& frame) {
  for (const auto& [unit, nj] : frame.by_unit_nj) by_unit_nj[unit] += nj;
}

namespace {

constexpr const char* kLeakage = "leakage";

// Ratio of the energy of an access to a memory of `bytes` to an access at the default capacity.
double access_ratio(std::int64_t bytes, std::int64_t default_bytes) {
  return std::sqrt(static_cast<double>(bytes) / static_cast<double>(default_bytes));
}

double with_access(const Machine& gpu, Access access, double pj) {
  switch (access) {
    case Access::kNone:
      return pj;
    case Access::kTileMemory:
      return pj * access_ratio(gpu.cores.memory_bytes, TileCores().memory_bytes);
    case Access::kTextureCache:  // 16 of its bytes at 2.5 pJ for 8, of 15 pJ
      return pj * (2 + access_ratio(gpu.caches.texture_bytes, Caches().texture_bytes)) / 3;
    case Access::kL2:
      return pj * access_ratio(gpu.caches.l2_bytes, Caches().l2_bytes);
  }
  return pj;
}

}  // namespace

FrameEnergy frame_energy(const Machine& gpu, const EnergyEvents& events, double cycles, double mm2) {
  FrameEnergy energy;
  const double voltage = supply_volts(gpu.clock_mhz, gpu.nominal_mhz) / kNominalVolts, square = voltage * voltage;
  const EventCounts counts = placed(gpu, events.counts);
  for (const Event event : kAllEvents) {
    const double pj = with_access(gpu, kEventTable[event].access, gpu.pj(event));
    energy.by_unit_nj[std::string(unit_name(event))] += static_cast<double>(counts[event]) * pj * square * 1e-3;
  }
  energy.by_unit_nj[std::string(name(Stage::kDram))] =
      static_cast<double>(events.dram_bytes * 8) * gpu.memory.pj_per_bit * 1e-3;
  // 1 mW for 1 us is 1 nJ.
  energy.by_unit_nj[kLeakage] = gpu.silicon.leakage_mw_per_mm2 * mm2 * voltage * cycles / gpu.clock_mhz;
  return energy;
}

double power_w(const Machine& gpu, const FrameEnergy& energy, double cycles, double frames) {
  const double us = cycles / gpu.clock_mhz / frames;
  if (!(us > 0)) return 0;
  const auto leakage = energy.by_unit_nj.find(kLeakage);
  const double leaked_nj = leakage == energy.by_unit_nj.end() ? 0 : leakage->second,
               interval_us = gpu.rate.target_fps > 0 ? std::max(us, 1e6 / gpu.rate.target_fps) : us;
  const double leaks_for = gpu.rate.gating == PowerGating::kBetweenFrames ? us : interval_us;
  // 1 nJ in 1 us is 1 mW.
  return ((energy.total_nj() - leaked_nj) / frames + leaked_nj / frames * leaks_for / us) / interval_us * 1e-3;
}

}  // namespace tessera::hardware
