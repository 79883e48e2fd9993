#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "gpu/configuration.h"
#include "gpu/work_recorder.h"
#include "hardware/energy.h"
#include "hardware/machine.h"
#include "timing/events/event_model.h"
#include "timing/timing_model.h"

namespace tessera::gpu {

// Cycles and energy of a frame on the described machine, and the schedule and events behind them.
struct MachineModel {
  FrameRecord record;
  timing::Schedule schedule;
  timing::FrameTiming timing;
  hardware::FrameEnergy energy;
  hardware::Area area;
  std::vector<memory::Burst> transactions;  // as simulate_events() gives them, on request
};

// Models the machine for the recorded work of a frame. `caches`, unless null: of events, in the state that the previous
// view left.
//
// model_machine() and view_cost() throw UsageError if shaders are compiled and a warp of one takes more registers than
// a core has.
MachineModel model_machine(const GpuConfiguration& gpu, FrameRecord record, timing::WarmCaches* caches = nullptr,
                           bool keep_transactions = false);

// The same for both eyes of a frame, one after the other, without the schedule.
struct FrameCost {
  timing::FrameTiming timing;
  hardware::FrameEnergy energy;
  hardware::Area area;
};
// The same for one eye, with the schedule.
struct ViewCost {
  timing::Schedule schedule;
  timing::FrameTiming timing;
  hardware::EnergyEvents events;
  hardware::FrameEnergy energy;
};
ViewCost view_cost(const GpuConfiguration& gpu, const timing::FrameWork& view, timing::WarmCaches* caches = nullptr,
                   std::vector<memory::Burst>* transactions = nullptr);
// `each`, unless empty, is called with each view, its cost, and the caches with which it began.
using EachView = std::function<void(const timing::FrameWork&, const ViewCost&, const timing::WarmCaches& before)>;
FrameCost frame_cost(const GpuConfiguration& gpu, const std::vector<timing::FrameWork>& views,
                     timing::WarmCaches* caches = nullptr, const EachView& each = {});

// Cycles and energy alone, without the bounding units: many times as fast with machine.timing=events.
struct CycleCost {
  double cycles = 0, energy_nj = 0;
  std::vector<std::pair<hardware::EnergyEvents, double>> views;  // events and cycles of each
};
CycleCost cycle_cost(const GpuConfiguration& gpu, std::span<const timing::FrameWork> views);
// The energy of the same work in the same cycles on a machine with other energies, areas or voltages.
double energy_nj(const GpuConfiguration& gpu, const CycleCost& cost);

// Caches from frame to frame, as gpu.queues.caches chooses: a frame that does not follow the last one finds them empty.
class CachesOfFrames {
 public:
  // Caches for the frame's views, in their order; nullptr if frames begin with empty caches.
  timing::WarmCaches* of_frame(const hardware::Machine& gpu, int frame) {
    if (gpu.queues.caches == hardware::FrameCaches::kEmpty) return nullptr;
    if (frame != next_ && frame != next_ - 1) caches_ = {};
    next_ = frame + 1;
    return &caches_;
  }

 private:
  timing::WarmCaches caches_;
  int next_ = 0;
};

}  // namespace tessera::gpu
