#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "hardware/machine.h"
#include "memory/dram_trace.h"
#include "timing/events/request_cache.h"
#include "timing/events/simulation_counts.h"
#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

// The content of caches between frames.
struct WarmCaches {
  std::optional<RequestCache> l2;
  std::vector<RequestCache> textures;  // by core
};

struct EventSchedule {
  Schedule schedule;
  StageCycles busy{};  // as FrameTiming::busy
  SimulationCounts counts;
};

// Whether a record has items, which simulate_events() needs.
bool has_items(const FrameWork& work);

// Simulates one frame item by item (TimingModel::kEvents). Tiles go to cores as in schedule_frame(); caches stay warm
// from tile to tile. The simulation is sequential and in a fixed order: the same bits on every host.
//
// Invariants (cited by the tests):
//   EM1  No unit is busy for longer than the frame; the memory moves every byte of the record that bypasses the L2, and a
//        line for each miss.
//   EM2  Every tile passes every phase once, in order, on one core.
//   EM3  A unit that is the only one to take time takes exactly its time.
//   EM4  The parts of the path add up to the frame.
//   EM5  The parts of a tile's path add up to the cycles from the core taking it to its last pixel.
// `caches`, unless nullptr, holds the caches after the previous frame and is replaced by their state after this one.
// `record_path` fills SimulationCounts::path and TileSchedule::path; a tile's wait for a phase that works on another
// tile is split as that tile's time in the phase. A frame that takes longer than `limit` may be left unfinished: only
// its cycles, which exceed `limit`, are then valid. `transactions`, unless nullptr, gets the bursts that the banks'
// channels take, in order, with clocks of the memory; it gets none with memory.model=fluid.
EventSchedule simulate_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches = nullptr,
                              bool record_path = false, double limit = std::numeric_limits<double>::infinity(),
                              std::vector<memory::Burst>* transactions = nullptr);

// Simulates the frame with its path, and finds its bound as time_frame() does. If a second thread is free, it
// simulates the doubling that is likely to be asked for first beside the frame; results do not depend on this.
struct TimedEvents {
  EventSchedule events;
  FrameTiming timing;
};
TimedEvents time_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches = nullptr,
                        std::vector<memory::Burst>* transactions = nullptr);

}  // namespace tessera::timing
