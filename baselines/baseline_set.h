#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "baselines/frame_work.h"
#include "baselines/scheme.h"
#include "baselines/scheme_work.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"
#include "gpu/work_recorder.h"
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

// Fills in the machines that tessellate first, for a pass that draws. `depths`: with a prepass, the depths that it leaves; it fills
// them in, the pass behind it reads them. `machine` is the machine's run, from which their
// work follows; with nullptr none is computed. `replay`: counters of the run of `job`, which give the traffic of the
// finished frame, its attachments or the shadow map, and its shading. `record`: its entries, which lead to the samples
// that triangles touch. Counters do not depend on the number of threads; cycles and energies are set for whole frames
// (set_cost()).
void measure_triangle_machines(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                               const frontend::PyramidLibrary& pyramids, const gpu::FrameCounters& replay,
                               const gpu::GpuConfiguration& gpu, BaselineSet& out, PrepassDepths* depths = nullptr,
                               const MachineWork* machine = nullptr, SchemeWorks* works = nullptr);

// The schemes in a pass of a frame: a shadow map, a prepass, the scene behind surfaces that transmit, the drawing of the camera's view,
// the lighting of a stored G-buffer, or a pass over images. Cycles and energies are zero: passes share the frame's units.
struct PassSet {
  std::string name;
  BaselineSet set;
};

// Runs every scheme on the frames of the device that it observes, pass by pass.
//
// Invariants (cited by the tests):
//   OBS1  The counters of a frame are the sums over its passes, but for cycles and energies.
//   OBS2  Schemes with tiles load and store as many bytes of attachments and maps as the machine does.
class BaselineObserver final : public gpu::ViewObserver {
 public:
  void map_rendered(const gpu::RenderedView& map) override;
  void view_rendered(const gpu::RenderedView& view) override;

  // Counters of the last rendered frame.
  const BaselineSet& last() const { return last_; }
  // The passes of that frame, in their order.
  const std::vector<PassSet>& passes() const { return passes_; }
  // Work of that frame, from which its cycles and energies follow; empty without output.machine_model.
  const SchemeWorks& works() const { return works_; }

 private:
  // The machine without splits of patches, whose run goes on from pass to pass.
  struct WholeRun {
    gpu::GpuConfiguration gpu;
    gpu::WorkRecorder recorder;
    memory::Ledger ledger;
    WholeRun(const gpu::RenderedView& view, bool items);
  };
  // A pass that draws: a shadow map, a prepass, the scene behind surfaces that transmit, or the pass that gives colours.
  struct DrawnView {
    const gpu::RenderedView& view;
    std::string_view name;
    const gpu::FrameCounters& counters;  // of the machine's run
    const gpu::ObservedWork& record;
    std::span<const timing::WorkRound> rounds;
    bool waits;  // its geometry waits for the tiles of all passes before
  };
  // The machine's run without splits of patches.
  struct WholeView {
    gpu::FrameResult result;
    gpu::ObservedWork record, before;
  };
  void begin_frame(const gpu::RenderedView& view);
  WholeView render_whole(const gpu::RenderedView& view, tilecore::TileJob job);
  // Measures a pass; `whole`: its counters and work without splits.
  void measure(const DrawnView& drawn, const tilecore::TileJob& job, const gpu::FrameCounters& whole,
               const gpu::ObservedWork& whole_record, PrepassDepths* depths);
  // Measures the pass that draws before the one that gives colours, and a pass over its image; `job` and `rounds` become
  // the ones of the passes after it. A prepass fills in `depths`.
  void measure_before(const gpu::RenderedView& view, const WholeView& whole, tilecore::TileJob& job,
                      std::span<const timing::WorkRound>& rounds, PrepassDepths& depths);
  // Adds passes over images; `rounds`: of the machine, or empty.
  void add_images(std::span<const gpu::PassResult> passes, std::span<const timing::WorkRound> rounds);
  void set_costs(const gpu::RenderedView& view, const WholeView& whole);

  BaselineSet last_;
  std::vector<PassSet> passes_;
  SchemeWorks works_;
  std::array<FrameWorkJoin, kSchemeCount> joined_;
  std::unique_ptr<WholeRun> whole_;
};

}  // namespace tessera::baselines
