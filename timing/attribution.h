#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "hardware/energy.h"
#include "hardware/stage.h"
#include "timing/events/event_model.h"
#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

// A drawable's share of a frame.
struct DrawableShare {
  std::uint64_t invocations = 0;      // of the pixel shader
  std::uint64_t tests = 0;            // lanes of box and triangle tests
  std::uint64_t requested_lines = 0;  // of the L2 and the texture caches
  std::uint64_t dram_bytes = 0;       // of the record's, read and written
  double cycles = 0;                  // of the frame's
  double energy_nj = 0;               // of the frame's
};
// Calls visit(name, a's member, b's member) for each part of two shares; everything that sums, prints or describes shares
// walks these.
template <class A, class B, class Visit>
void for_each_part(A& a, B& b, const Visit& visit) {
  visit("invocations", a.invocations, b.invocations);
  visit("tests", a.tests, b.tests);
  visit("requested_lines", a.requested_lines, b.requested_lines);
  visit("dram_bytes", a.dram_bytes, b.dram_bytes);
  visit("cycles", a.cycles, b.cycles);
  visit("energy_nj", a.energy_nj, b.energy_nj);
}
inline DrawableShare& operator+=(DrawableShare& sum, const DrawableShare& share) {
  for_each_part(sum, share, [](const char*, auto& into, const auto& more) { into += more; });
  return sum;
}

// Shares of all drawables, by SubPatchItem::drawable; 0: what no item of a tile asked for (resolve, tiles without items).
// What the front end and the binner do is split by entries of tile lists. What a unit of a core does in a tile is split by the events of the tile's items, resolve by
// invocations. A drawable's cycles are what units have of the critical path, each split by who kept the unit busy, latency
// and memory by requested lines; where there is no path, by the cycles that units were busy. Bytes before shading are
// split by list entries and requested lines, those of shading by requested lines, those of storing by invocations.
// Energies follow: units by their events, memory by bytes, L2 by requested lines, leakage by cycles.
//
// Invariants (cited by the tests):
//   AT1  Cycles, bytes and energies add up to the frame's, invocations to the tiles' own.
// Needs items (has_items()). `energy`: of the frame.
std::map<std::uint32_t, DrawableShare> attribute(const hardware::Machine& gpu, const FrameWork& work,
                                                 const FrameTiming& timing, const hardware::FrameEnergy& energy);

// What a tile has of a frame.
struct TileShare {
  std::uint32_t tile = 0;
  double cycles = 0;  // from the core taking it to its last pixel, all its rounds
  std::uint64_t dram_bytes = 0;
  double energy_nj = 0;           // of the units of its core, and of memory
  std::optional<Bound> bound_by;  // twice of what shortens its cycles most; chosen as in find_bound()
  double bound_cycles = 0;        // by how much
};
// How the bounds of tiles are found.
enum class TileBounds : std::uint8_t {
  kNone,
  kDoubled,   // the frame is simulated once more for each unit that has work in a tile, for memory, L2, caches, latency
  kEstimated  // twice of something is taken to halve its part of TileSchedule::path; no caches
};
// Tile by tile, in the order of their numbers. `before`: the caches with which the frame began.
std::vector<TileShare> attribute_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule,
                                       const WarmCaches& before = {}, TileBounds bounds = TileBounds::kDoubled);

}  // namespace tessera::timing
