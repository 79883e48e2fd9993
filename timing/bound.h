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

// What the length of a frame hangs on: a unit, under its Stage's number, or what no unit has to itself.
enum class Bound : std::uint8_t {
  kLatency = hardware::kStageCount,  // of memory, L2 and texture units, and how much may be under way meanwhile
  kL2,                               // its rate
  kCaches,                           // sizes of the L2 and the texture caches
  kTileMemory,                       // tiles that a core works on at once
  kGeometry,                         // front end and binner together, before any tile
  kTileCores,                        // all units of the cores together
  kImbalance                         // cores with nothing left to do while others work
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

// The machine with twice as much of it: twice the rate, the number or the size; half the latencies and room for twice
// as many requests. Not of kImbalance, which no number of the machine removes.
hardware::Machine doubled(const hardware::Machine& gpu, Bound bound);

// A guess at what twice as much of something saves, in cycles: never less than it does.
struct BoundGuess {
  Bound bound{};
  double most = 0;
};
// The same, found by simulating the frame again.
struct BoundGain {
  Bound bound{};
  double cycles = 0;
};

// What bounds a frame: of all that gain at least kNearlyBest of the best doubling, the first in the order of Bound, which
// is the most specific. Doublings are simulated, the most specific of those with great guesses first, until no other can
// change the answer: it is that of simulating all. `cycles`: of the frame. `imbalance`: what it would save if all cores
// ended together. `with_twice`: cycles of the frame on doubled(gpu, bound) or, of a frame that takes longer than `limit`,
// anything above that; asked of several threads. Gain 0: nothing gains anything.
inline constexpr double kNearlyBest = 0.8;
BoundGain find_bound(double cycles, std::vector<BoundGuess> guesses, double imbalance,
                     const std::function<double(Bound, double limit)>& with_twice);

}  // namespace tessera::timing
