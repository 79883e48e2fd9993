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

// What caches hold between frames.
struct WarmCaches {
  std::optional<RequestCache> l2;
  std::vector<RequestCache> textures;  // by core
};

struct EventSchedule {
  Schedule schedule;
  StageCycles busy{};  // as FrameTiming::busy
  SimulationCounts counts;
};

// Whether a record has what events are made of.
bool has_items(const FrameWork& work);

// Simulates one frame item by item (TimingModel::kEvents). Tiles go to cores as in schedule_frame(); caches stay
// warm from tile to tile. Sequential and in a fixed order: the same bits on every host.
//
// Invariants (cited by the tests):
//   EM1  No unit is busy for longer than the frame; the memory moves every byte of the record that bypasses the L2, and a
//        line for each miss.
//   EM2  Every tile passes every phase once, in order, on one core.
//   EM3  A unit that is the only one to take time takes exactly its time.
//   EM4  The parts of the path add up to the frame.
//   EM5  The parts of a tile's path add up to the cycles from the core taking it to its last pixel.
// `caches`, unless null: what they hold of the frame before, replaced by what this one leaves. `record_path`: fills
// SimulationCounts::path and TileSchedule::path, in which a wait for a phase that works on another tile goes to what that one
// spends there. `limit`: a frame that takes longer need not be simulated to its end; then only its cycles, which are
// more than `limit`, mean anything. `transactions`, unless null: gets the bursts that the banks' channels take, with clocks
// of the memory, in their order; with memory.model=fluid nothing.
EventSchedule simulate_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches = nullptr,
                              bool record_path = false, double limit = std::numeric_limits<double>::infinity(),
                              std::vector<memory::Burst>* transactions = nullptr);

// The frame with its path, and as time_frame() what bounds it. Where a second thread is free it simulates, beside the
// frame, the doubling that is likely asked for first; results do not depend on it.
struct TimedEvents {
  EventSchedule events;
  FrameTiming timing;
};
TimedEvents time_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches = nullptr,
                        std::vector<memory::Burst>* transactions = nullptr);

}  // namespace tessera::timing
