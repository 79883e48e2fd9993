#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "hardware/stage.h"
#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

// What a drawable has of a frame.
struct DrawableShare {
  std::uint64_t invocations = 0;      // of the pixel shader
  std::uint64_t tests = 0;            // lanes of box and triangle tests
  std::uint64_t requested_lines = 0;  // of the L2 and the texture caches
  double cycles = 0;                  // of the frame's
  double energy_nj = 0;               // of the units of tile cores; without memory, L2, leakage
};

// Shares of all drawables, by SubPatchItem::drawable; 0: what no item of a tile asked for (geometry, resolve, tiles
// without items). What a unit of a core does in a tile is split by the events of the tile's items, resolve by
// invocations. A drawable's cycles are what units have of the critical path, each split by who kept the unit busy, latency
// and memory by requested lines; where there is no path, by the cycles that units were busy.
//
// Invariants (cited by the tests):
//   AT1  Cycles add up to the frame, energies to those of the units of tile cores, invocations to the tiles' own.
// Needs items (has_items()).
std::map<std::uint32_t, DrawableShare> attribute(const hardware::Machine& gpu, const FrameWork& work,
                                                 const FrameTiming& timing);

// What a tile has of a frame.
struct TileShare {
  std::uint32_t tile = 0;
  double cycles = 0;  // from the core taking it to its last pixel, all its rounds
  std::uint64_t dram_bytes = 0;
  double energy_nj = 0;       // of the units of its core, and of memory
  hardware::Stage busiest{};  // unit with most cycles for it; kDram: its bytes take longer
};
// Tile by tile, in the order of their numbers.
std::vector<TileShare> attribute_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule);

}  // namespace tessera::timing
