#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "hardware/machine.h"

namespace tessera::hardware {

// Counts of a frame's events, and its bytes over the external memory interface.
struct EnergyEvents {
  EventCounts counts;
  std::uint64_t dram_bytes = 0;
};

// Energy of a frame in nanojoules by unit: each stage by its name, and "l2" and "leakage".
//
//   unit     = its events x the energy of one (energy.*) x (V / nominal V)^2, V by clock.mhz (hardware/voltage.h)
//   dram     = bits over the external interface x memory.pj_per_bit, at the memory's own voltage
//   leakage  = energy.leakage_mw_per_mm2 x mm2 x V / nominal V x cycles / clock
//
// The energy of an access to an on-chip memory grows with the square root of its capacity. This applies to l2 lines,
// to hits and depth blocks of the tile memory, and to a third of a lookup (16 of its bytes at 2.5 pJ for 8, of 15 pJ).
//
// The model shows where energy goes; it does not describe a real part. docs/timing_model.md gives the basis of its numbers.
struct FrameEnergy {
  std::map<std::string, double> by_unit_nj;

  // Sum over the units in the order of their names.
  double total_nj() const;
  void accumulate(const FrameEnergy& frame);
};
// Power in watts at machine.target_fps, of a mean frame: `energy` and `cycles` are sums over `frames`. The energy of
// events grows with the frame rate; leakage lasts as long as the GPU is supplied.
double power_w(const Machine& gpu, const FrameEnergy& energy, double cycles, double frames);

// Energy of one frame; `mm2` is the area of the whole machine (hardware/area.h).
FrameEnergy frame_energy(const Machine& gpu, const EnergyEvents& events, double cycles, double mm2);

}  // namespace tessera::hardware
