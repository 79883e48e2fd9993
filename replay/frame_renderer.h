#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "frontend/assembly.h"
#include "frontend/capture.h"
#include "frontend/front_end.h"
#include "hardware/configuration.h"
#include "hardware/energy.h"
#include "hardware/ledger.h"
#include "hardware/timing_model.h"
#include "replay/baselines.h"
#include "replay/effect_report.h"
#include "replay/resolve_sequence.h"
#include "replay/settings.h"
#include "replay/tile_maps.h"
#include "replay/work_recorder.h"
#include "tilecore/resolve/compressed_store.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// All counters of one frame, or of several.
struct FrameCounters : tilecore::CoreCounters {
  frontend::FrontendCounters frontend;
  binner::BinnerCounters binner;
  tilecore::TessellationCounters tessellation;
  L2Counters l2;
  tilecore::CompressionCounters compression;
  hardware::Ledger ledger;

  // Joins the counters of a further frame into a total.
  void accumulate(const FrameCounters& frame);
  // Adds what another view of the same frame took.
  void merge(const FrameCounters& view);
};

// Calls visit(a's, b's) for each counter struct.
template <class A, class B, class Visit>
void for_each_counter_struct(A& a, B& b, const Visit& visit) {
  visit(a.frontend, b.frontend);
  visit(a.binner, b.binner);
  visit(a.tessellation, b.tessellation);
  tilecore::for_each_unit(a, b, visit);
  visit(a.l2, b.l2);
  visit(a.compression, b.compression);
}

// Cycles and energy of a frame on the described machine, and how they came about.
struct MachineModel {
  FrameRecord record;
  hardware::Schedule schedule;
  hardware::FrameTiming timing;
  hardware::FrameEnergy energy;
};

// The right eye's picture; its counters are in those of the frame, too.
struct RightEye {
  tilecore::FrameTargets targets;
  FrameCounters counters;
};

struct FrameResult {
  FrameResult(int number, tilecore::FrameTargets pictures) : frame(number), targets(std::move(pictures)) {}

  int frame;
  tilecore::FrameTargets targets;
  FrameCounters counters;
  FrameEffects effects;
  EffectReasons effect_reasons;  // why each ran, or did not
  FrameEffectPlaces effect_places;
  std::optional<RightEye> right;
  std::map<std::string, double>
      stage_seconds;  // host time; tile_threads, resolve_threads: processor time, summed over threads
  double seconds = 0;
  std::optional<BaselineSet> baselines;
  std::optional<MachineModel> model;  // with output.machine_model
  TileMaps maps{};
};

// What all replays of one capture share, whatever the machine and the settings. Read only: many renderers may use it at
// once.
struct PreparedCapture {
  // `capture_in` must outlive it.
  explicit PreparedCapture(const frontend::Capture& capture_in)
      : capture(capture_in), assembly(frontend::assemble(capture_in)), pyramids(assembly) {}

  const frontend::Capture& capture;
  const frontend::Assembly assembly;
  const frontend::PyramidLibrary pyramids;
};

// What to render of a capture.
struct RenderRequest {
  int width = 0, height = 0;
  IntRect region;  // pixels; whole frame by default
  bool auxiliary = false;
  bool baselines = false;          // run the other schemes as well
  bool record_accesses = false;    // keep every transfer over the memory interface, for traces
  bool resolve_auxiliary = false;  // pictures of what the resolve unit did; with desampling only
  bool error = false;              // and of its error: renders every frame fully as well
};

// Sends frames of a capture through the machine: front end, binner, tile cores, resolve. Pictures and counters are
// independent of each other and of the number of threads, but for frontend.previous_depth_culling (counters) and
// resolve.desampling=adaptive (both), which look at the frame rendered before when that was the one before.
class FrameRenderer {
 public:
  // `capture` must outlive the renderer.
  FrameRenderer(const frontend::Capture& capture, const hardware::GpuConfiguration& gpu, const RunSettings& settings,
                const RenderRequest& request)
      : FrameRenderer(std::make_shared<const PreparedCapture>(capture), gpu, settings, request) {}
  FrameRenderer(std::shared_ptr<const PreparedCapture> prepared, const hardware::GpuConfiguration& gpu,
                const RunSettings& settings, const RenderRequest& request);

  FrameResult render(int frame);

  // What the frame rendered last leaves to the next, with resolve.desampling=adaptive; and to go on from that of
  // another replay.
  const tilecore::History& history() const { return eyes_[0].sequence.history(); }
  void set_history(tilecore::History history) { eyes_[0].sequence.set_history(std::move(history)); }

  // Whether the camera was made up because the capture has none.
  bool automatic_camera() const { return camera_.node == frontend::kNone; }
  const frontend::Assembly& assembly() const { return assembly_; }
  // Cache lines of all textures, displacement maps last.
  std::uint64_t texture_lines() const { return displacement_memory_.end(); }

 private:
  // A view of the scene that is rendered, and what its frames leave to each other.
  struct Eye {
    frontend::CameraChoice camera;
    ResolveSequence sequence;
  };

  frontend::FrameRequest frame_request(int frame) const;
  // Renders one view into `result`. `left`: the pose of the finished left eye, for the right one.
  std::unique_ptr<frontend::FrameGeometry> render_view(int frame, Eye& eye, const frontend::FrameGeometry* left,
                                                       FrameResult& result);
  // What stencils that reach into neighbouring tiles left open, and the time of the resolve unit.
  void finish_deferred(const tilecore::TileJob& job, const binner::Binner& binner, WorkRecorder& recorder,
                       FrameResult& result);
  // Renders the same frame fully and writes the difference to result.targets.error.
  void measure_error(const tilecore::TileJob& job, FrameResult& result);
  tilecore::TileJob make_job(const frontend::FrameGeometry& frame, const binner::TileGrid& grid,
                             const tilecore::SamplePattern& pattern) const;
  // The machine of `gpu` from the front end on; adds to `result`, to `recorder` and, unless null, to `record`.
  void run_machine(const hardware::GpuConfiguration& gpu, const frontend::OcclusionGuess* guess,
                   const tilecore::TileJob& job, WorkRecorder& recorder, FrameResult& result, MachineRecord* record);
  // The sparse pass of the sampling controller; null where ordinary patches draw the procedures, or there are none.
  std::unique_ptr<tilecore::ParameterMaps> map_procedures(const tilecore::TileJob& job, FrameResult& result) const;
  // Bins, renders and finishes tiles: all of them, or those that `only` marks.
  void run_tiles(const tilecore::TileJob& job, binner::Binner& binner,
                 std::span<const frontend::BoundedSubPatch> sub_patches, const std::vector<bool>& only,
                 tilecore::TessellationCache& cache, WorkRecorder& recorder, FrameResult& result,
                 MachineRecord* record);
  // Renders again the tiles where something that the previous frame's depth hid is visible after all.
  void render_revived(const tilecore::TileJob& job, binner::Binner& binner, frontend::FrontEndResult& front_end,
                      tilecore::TessellationCache& cache, WorkRecorder& recorder, FrameResult& result,
                      MachineRecord* record);
  void collect(const binner::Binner& binner, const tilecore::TessellationCache& cache, WorkRecorder& recorder,
               FrameResult& result);
  frontend::CoarseDepth coarse_depth(const tilecore::TileJob& job, const FrameResult& result) const;
  BaselineSet run_baselines(const tilecore::TileJob& job, const FrameResult& result, const MachineRecord& record);

  std::shared_ptr<const PreparedCapture> prepared_;
  const frontend::Capture& capture_;
  hardware::GpuConfiguration gpu_;
  RunSettings settings_;
  RenderRequest request_;
  const frontend::Assembly& assembly_;
  const frontend::PyramidLibrary& pyramids_;
  tilecore::TextureMemory texture_memory_;
  DisplacementMemory displacement_memory_;
  frontend::CameraChoice camera_;
  tilecore::ResolveSettings resolve_;
  std::vector<Eye> eyes_;  // the left or only one, the right one
  PerThread<tilecore::TileCore> cores_;
  std::optional<frontend::CoarseDepth> last_depth_;  // of frame last_frame_, where the next may use it
  int last_frame_ = 0;
};

}  // namespace tessera::replay
