#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "hardware/machine.h"

namespace tessera::hardware {

// Silicon beside the rates of a Machine: on-chip memories (shared by the machine, and of each core), units that hash tiles'
// inputs (one in the machine) and colours (one in each core), and decoders of geometry (in the front end and in each core).
struct OtherParts {
  std::int64_t shared_bytes = 0, core_bytes = 0;
  bool hashes_inputs = false, hashes_colors = false, decodes_geometry = false;
};

// Silicon of the machine by unit, in mm2 of a 7-nm process:
//
//   frontend, binner     their rates x area.*, the binner's hashing unit with it
//   fixed_units          of all cores: area.core_mm2 each, tessellator, decoder, lanes of tests, blending, resolve,
//                        hashing by their rates
//   lanes                of the pixel shader and of the sampling array
//   texture              lookups per clock x area.texel_mm2
//   registers, tile_memory, texture_cache, l2, other_memories    KiB x their density
//
// Area is proportional to throughput and capacity, so that no rate and no memory is free. It is a model, not a floor
// plan: wires between units, the memory's PHY and the parts of a phone beside the GPU are not included.
//
// Invariants (cited by the tests):
//   AREA1  The units add up to the total; each is proportional to the number of cores, except front end, binner, l2 and
//          shared memories.
//   AREA2  A higher rate or a larger memory never makes the area smaller.
struct Area {
  std::map<std::string, double> by_unit_mm2;

  double total_mm2() const;  // summed in the order of the units' names
};
Area machine_area(const Machine& gpu, const OtherParts& others);

}  // namespace tessera::hardware
