#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "hardware/machine.h"
#include "hardware/stage.h"

namespace tessera::timing {

// A limit of a frame's length: a unit, under its Stage's number, or a limit that belongs to no single unit.
enum class Bound : std::uint8_t {
  kLatency = hardware::kStageCount,  // latency of memory, L2 and texture units, and the number of requests in flight
  kL2,                               // rate of the L2
  kCaches,                           // sizes of the L2 and the texture caches
  kTileMemory,                       // number of tiles that a core works on at once
  kGeometry,                         // front end and binner together, before any tile
  kTileCores,                        // all units of the cores together
  kImbalance                         // idle cores while other cores work
};
inline constexpr std::size_t kBoundCount = hardware::kStageCount + 7;

constexpr Bound bound_of(hardware::Stage stage) { return static_cast<Bound>(stage); }
constexpr std::size_t index(Bound bound) { return static_cast<std::size_t>(bound); }
constexpr std::string_view name(Bound bound) {
  constexpr std::array<std::string_view, kBoundCount - hardware::kStageCount> kNames = {
      "latency", "l2", "caches", "tile_memory", "geometry", "tilecores", "imbalance"};
  return index(bound) < hardware::kStageCount ? name(static_cast<hardware::Stage>(bound))
                                              : kNames[index(bound) - hardware::kStageCount];
}

// The machine with the bound doubled: twice the rate, the number or the size; for kLatency half the latencies and
// room for twice as many requests. kImbalance is not allowed, as no number of the machine removes it.
hardware::Machine doubled(const hardware::Machine& gpu, Bound bound);

// Upper bound of the cycles that a doubling saves, as a guess before it is simulated.
struct BoundGuess {
  Bound bound{};
  double most = 0;
};
// Cycles that a doubling saves, found by simulating the frame again.
struct BoundGain {
  Bound bound{};
  double cycles = 0;
};

// Finds the bound of a frame: the first in the order of Bound, which is the most specific one, whose doubling gains
// at least kNearlyBest of the best doubling. Doublings are simulated, starting with the most specific of those with
// great guesses, until no other can change the answer; the answer is the same as if all were simulated. `cycles`:
// cycles of the frame. `imbalance`: cycles that it would save if all cores ended together. `with_twice`: cycles of
// the frame on doubled(gpu, bound), or any value above `limit` for a frame that takes longer; several threads call
// it. Returns gain 0 when no doubling gains cycles.
inline constexpr double kNearlyBest = 0.8;
BoundGain find_bound(double cycles, std::vector<BoundGuess> guesses, double imbalance,
                     const std::function<double(Bound, double limit)>& with_twice);

}  // namespace tessera::timing
