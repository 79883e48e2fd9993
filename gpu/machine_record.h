#pragma once

#include <vector>

#include "binner/queue_entry.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// What a run of the machine asked of its tile cores, kept to be looked at by the baselines.
struct MachineRecord {
  std::vector<std::vector<binner::QueueEntry>> entries;      // per tile; records numbered on where lists were emptied
  std::vector<tilecore::TessellationRequest> tessellations;  // tile by tile, in emulated order
};

}  // namespace tessera::gpu
