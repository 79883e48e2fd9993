#pragma once

#include <array>

#include "baselines/baseline_counters.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/machine_record.h"
#include "gpu/view_observer.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

// What every scheme did for one frame, or for several.
struct BaselineSet {
  std::array<BaselineCounters, kSchemeCount> schemes;
  BaselineCounters& operator[](Scheme scheme) { return schemes[static_cast<std::size_t>(scheme)]; }
  const BaselineCounters& operator[](Scheme scheme) const { return schemes[static_cast<std::size_t>(scheme)]; }
  void accumulate(const BaselineSet& frame);
};

// The machine of `gpu` without splits: one queue entry per base patch, tessellated as a whole by every tile that it may
// touch. Every frame by itself.
gpu::GpuConfiguration patch_whole_machine(gpu::GpuConfiguration gpu);

// Counters of a machine that bins patches, from those of its run. The cache of tessellator.cache_bytes holds, per
// sub-patch, 12 bytes for each vertex and key; tiles use it in the order in which they were rendered.
BaselineCounters measure_patch_machine(const gpu::FrameCounters& counters, const gpu::MachineRecord& record);

// The two machines that tessellate first. `frame_ledger`: that of the run of `job`, for what the finished frame takes.
// `record`: its entries, which lead the immediate machine to the samples that its triangles touch. Counters do not
// depend on the number of threads.
struct TriangleMachines {
  BaselineCounters post_tessellation, immediate;
};
TriangleMachines measure_triangle_machines(const tilecore::TileJob& job, const gpu::MachineRecord& record,
                                           const memory::Ledger& frame_ledger, const gpu::GpuConfiguration& gpu);

// Runs every scheme on the frames of the device that it observes.
class BaselineObserver final : public gpu::ViewObserver {
 public:
  void view_rendered(const gpu::RenderedView& view) override;

  // Of the frame that was rendered last.
  const BaselineSet& last() const { return last_; }

 private:
  BaselineSet last_;
};

}  // namespace tessera::baselines
