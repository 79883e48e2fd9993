#pragma once

#include <array>

#include "baselines/scheme.h"
#include "baselines/scheme_work.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

// Counters of all schemes for one frame, or for several.
struct BaselineSet {
  std::array<BaselineCounters, kSchemeCount> schemes;
  BaselineCounters& operator[](SchemeId scheme) { return schemes[static_cast<std::size_t>(scheme)]; }
  const BaselineCounters& operator[](SchemeId scheme) const { return schemes[static_cast<std::size_t>(scheme)]; }
  void accumulate(const BaselineSet& frame);
};

// The work of every scheme for one frame; the machine's own is the recorded work of its run.
using SchemeWorks = std::array<timing::FrameWork, kSchemeCount>;

// Counters of a machine that bins patches, computed from the counters of its run.
BaselineCounters measure_patch_machine(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                                       const gpu::PatchTable& records, const gpu::FrameCounters& counters,
                                       const gpu::ObservedWork& record);

// Fills in the machines that tessellate first. `machine` is the machine's run, from which their work, cycles and
// energies follow; with nullptr none of these are computed. `replay`: counters of the run of `job`, which give the
// traffic of the finished frame and its shading. `record`: its entries, which lead to the samples that triangles
// touch. Counters do not depend on the number of threads.
void measure_triangle_machines(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                               const frontend::PyramidLibrary& pyramids, const gpu::FrameCounters& replay,
                               const gpu::GpuConfiguration& gpu, BaselineSet& out, const MachineWork* machine = nullptr,
                               SchemeWorks* works = nullptr);

// Runs every scheme on the frames of the device that it observes.
class BaselineObserver final : public gpu::ViewObserver {
 public:
  void view_rendered(const gpu::RenderedView& view) override;

  // Counters of the last rendered frame.
  const BaselineSet& last() const { return last_; }
  // Work of that frame, from which its cycles and energies follow; empty without output.machine_model.
  const SchemeWorks& works() const { return works_; }

 private:
  void add_patch_machine(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work,
                         const gpu::FrameCounters& counters, SchemeId scheme);

  BaselineSet last_;
  SchemeWorks works_;
};

}  // namespace tessera::baselines
