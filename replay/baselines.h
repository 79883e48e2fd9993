#pragma once

#include <array>

#include "binner/baselines/baseline_counters.h"
#include "binner/tile_grid.h"
#include "frontend/frame_geometry.h"
#include "hardware/configuration.h"
#include "hardware/ledger.h"
#include "replay/machine_record.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

struct FrameCounters;

// What every scheme did for one frame, or for several.
struct BaselineSet {
  std::array<binner::BaselineCounters, binner::kSchemeCount> schemes;
  binner::BaselineCounters& operator[](binner::Scheme scheme) { return schemes[static_cast<std::size_t>(scheme)]; }
  const binner::BaselineCounters& operator[](binner::Scheme scheme) const {
    return schemes[static_cast<std::size_t>(scheme)];
  }
  void accumulate(const BaselineSet& frame);
};

// The machine of `gpu` without splits: one queue entry per base patch, tessellated as a whole by every tile that it may
// touch. Every frame by itself.
hardware::GpuConfiguration patch_whole_machine(hardware::GpuConfiguration gpu);

// Counters of a machine that bins patches, from those of its run. The cache of tessellator.cache_bytes holds, per
// sub-patch, 12 bytes for each vertex and key; tiles use it in the order in which they were rendered.
binner::BaselineCounters measure_patch_machine(const FrameCounters& counters, const MachineRecord& record);

// The two machines that tessellate first. `frame_ledger`: that of the run of `job`, for what the finished frame takes.
// `record`: its entries, which lead the immediate machine to the samples that its triangles touch. Counters do not
// depend on the number of threads.
struct TriangleMachines {
  binner::BaselineCounters post_tessellation, immediate;
};
TriangleMachines measure_triangle_machines(const tilecore::TileJob& job, const MachineRecord& record,
                                           const hardware::Ledger& frame_ledger, const hardware::GpuConfiguration& gpu);

}  // namespace tessera::replay
