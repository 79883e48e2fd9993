#pragma once

#include <map>
#include <string>

#include "hardware/work.h"

namespace tessera::hardware {

// Energy of a frame in nanojoules, by unit: names of stages, "l2" and "leakage" beside them.
//
//   unit     = its events x the energy of one (energy.*)
//   dram     = bits over the external interface x memory.pj_per_bit
//   leakage  = energy.leakage_mw x cycles / clock
//
// A model of where energy goes, not of a part: see docs/timing_model.md for what its numbers rest on.
struct FrameEnergy {
  std::map<std::string, double> by_unit_nj;

  // Sum over the units in the order of their names.
  double total_nj() const;
  void accumulate(const FrameEnergy& frame);
};
FrameEnergy frame_energy(const GpuConfiguration& gpu, const FrameWork& work, double cycles);

}  // namespace tessera::hardware
