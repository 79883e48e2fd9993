#pragma once

#include <vector>

#include "gpu/work_recorder.h"
#include "hardware/energy.h"
#include "hardware/machine.h"
#include "timing/timing_model.h"

namespace tessera::gpu {

// Cycles and energy of a frame on the described machine, and how they came about.
struct MachineModel {
  FrameRecord record;
  timing::Schedule schedule;
  timing::FrameTiming timing;
  hardware::FrameEnergy energy;
};

// What the machine needs for what was recorded of a frame.
MachineModel model_machine(const hardware::Machine& gpu, FrameRecord record);

// The same of a frame's eyes, one after the other, without the schedule.
struct FrameCost {
  timing::FrameTiming timing;
  hardware::FrameEnergy energy;
};
FrameCost frame_cost(const hardware::Machine& gpu, const std::vector<timing::FrameWork>& views);

}  // namespace tessera::gpu
