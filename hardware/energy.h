#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "hardware/machine.h"

namespace tessera::hardware {

// What units did in a frame, and bytes over the external memory interface.
struct EnergyEvents {
  EventCounts counts;
  std::uint64_t dram_bytes = 0;
};

// Energy of a frame in nanojoules, by unit: names of stages, "l2" and "leakage" beside them.
//
//   unit     = its events x the energy of one (energy.*) x (V / nominal V)^2, V by clock.mhz (hardware/voltage.h)
//   dram     = bits over the external interface x memory.pj_per_bit, at the memory's own voltage
//   leakage  = energy.leakage_mw_per_mm2 x mm2 x V / nominal V x cycles / clock
//
// An access to a memory on chip goes with the square root of its capacity: l2 lines, hits and depth blocks of the tile
// memory, a third of a lookup (16 of its bytes at 2.5 pJ for 8, of 15 pJ).
//
// A model of where energy goes, not of a part: see docs/timing_model.md for what its numbers rest on.
struct FrameEnergy {
  std::map<std::string, double> by_unit_nj;

  // Sum over the units in the order of their names.
  double total_nj() const;
  void accumulate(const FrameEnergy& frame);
};
// Power in watts at machine.target_fps, of a mean frame: `energy` and `cycles` are sums over `frames`. What events take
// goes with the rate of frames; leakage lasts as long as the GPU's supply is there.
double power_w(const Machine& gpu, const FrameEnergy& energy, double cycles, double frames);

// `mm2`: all of the machine (hardware/area.h).
FrameEnergy frame_energy(const Machine& gpu, const EnergyEvents& events, double cycles, double mm2);

}  // namespace tessera::hardware
