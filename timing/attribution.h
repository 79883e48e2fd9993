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

// One drawable's share of a frame's work.
struct DrawableShare {
  std::uint64_t invocations = 0;      // pixel-shader invocations
  std::uint64_t tests = 0;            // lanes of box and triangle tests
  std::uint64_t requested_lines = 0;  // lines asked of the L2 and the texture caches
  std::uint64_t dram_bytes = 0;       // bytes of the record, read and written
  double cycles = 0;                  // cycles of the frame
  double energy_nj = 0;               // energy of the frame
};
// Calls visit(name, a's member, b's member) for each part of two shares. All code that sums, prints or describes shares uses this list.
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

// Shares of all drawables, by SubPatchItem::drawable. Key 0 holds work that no item of a tile caused (resolve, tiles
// without items). The work is split as follows:
//
//   front end, binner   by entries of tile lists
//   units of a core     by the events of the tile's items; resolve by invocations
//   cycles              the units' parts of the critical path, each by the drawables that kept the unit busy, latency and
//                       memory by requested lines; without a recorded path, by the cycles in which units were busy
//   bytes               before shading by list entries and requested lines, of shading by requested lines, of storing by
//                       invocations
//   energy              units by their events, memory by bytes, L2 by requested lines, leakage by cycles
//
// Invariants (cited by the tests):
//   AT1  Cycles, bytes and energies add up to the frame's, invocations to the tiles' own.
// Needs items (has_items()). `energy` is the frame's energy.
std::map<std::uint32_t, DrawableShare> attribute(const hardware::Machine& gpu, const FrameWork& work,
                                                 const FrameTiming& timing, const hardware::FrameEnergy& energy);

// One tile's share of a frame.
struct TileShare {
  std::uint32_t tile = 0;
  double cycles = 0;  // from the core taking the tile to its last pixel, summed over its rounds
  std::uint64_t dram_bytes = 0;
  double energy_nj = 0;           // energy of the units of its core, and of memory
  std::optional<Bound> bound_by;  // the bound whose doubling saves the tile most cycles, chosen as in find_bound()
  double bound_cycles = 0;        // cycles that the doubling saves
};
// How the bounds of tiles are found.
enum class TileBounds : std::uint8_t {
  kNone,
  kDoubled,   // one more simulation for each unit with work in a tile, and for memory, L2, caches and latency
  kEstimated  // doubling is assumed to halve the bound's part of TileSchedule::path; caches are left out
};
// Shares of all tiles in the order of their numbers. `before`: the caches with which the frame began.
std::vector<TileShare> attribute_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule,
                                       const WarmCaches& before = {}, TileBounds bounds = TileBounds::kDoubled);

}  // namespace tessera::timing
