#pragma once

#include <optional>

#include "hardware/machine.h"
#include "timing/events/event_counts.h"
#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

struct EventSchedule {
  Schedule schedule;
  StageCycles busy{};  // as FrameTiming::busy
  EventCounts counts;
};

// Whether a record has what events are made of.
bool has_items(const FrameWork& work);

// Simulates one frame item by item (TimingModel::kEvents). Tiles go to cores as in schedule_frame(); caches are empty at
// first and stay warm from tile to tile. Sequential and in a fixed order: the same bits on every host.
//
// Invariants (cited by the tests):
//   EM1  No unit is busy for longer than the frame; the memory moves every byte of the record that bypasses the L2, and a
//        line for each miss.
//   EM2  Every tile passes every phase once, in order, on one core.
//   EM3  A unit that is the only one to take time takes exactly its time.
EventSchedule simulate_events(const hardware::Machine& gpu, const FrameWork& work,
                              std::optional<Stage> infinitely_fast = std::nullopt);

// As time_frame(), from what simulate_events() gave.
FrameTiming time_events(const hardware::Machine& gpu, const FrameWork& work, const EventSchedule& schedule);

}  // namespace tessera::timing
