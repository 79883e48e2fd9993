#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "hardware/machine.h"

namespace tessera::hardware {

// What units did in a frame, as far as it costs energy: one member per price of the machine.
struct EnergyEvents {
  std::uint64_t bounds = 0, reprojected_blocks = 0, depth_tests = 0, binned_entries = 0;
  std::uint64_t fetched_entries = 0, sort_steps = 0, vertices = 0, transforms = 0, boxes = 0, box_tests = 0,
                stencil_tests = 0;
  std::uint64_t sampling_operations = 0, triangle_tests = 0, hits = 0, alpha_tests = 0;
  std::uint64_t depth_blocks = 0, compacted_samples = 0, surface_evaluations = 0;
  // Of lanes, for compiled shaders; then there are no invocations beside them, nor vertices where lanes shade these.
  std::uint64_t shader_clocks = 0;
  std::uint64_t domain_texels = 0;  // lookups of heights where lanes shade vertices
  std::uint64_t shader_invocations = 0, texels = 0, l2_lines = 0, blended_layers = 0;
  std::uint64_t pixels = 0, resolve_operations = 0;
  std::uint64_t hashed_inputs = 0, hashed_colors = 0;  // bytes
  std::uint64_t triangles = 0;                         // set up before they are binned
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
// `mm2`: all of the machine (hardware/area.h).
FrameEnergy frame_energy(const Machine& gpu, const EnergyEvents& events, double cycles, double mm2);

}  // namespace tessera::hardware
