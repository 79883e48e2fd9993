#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

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
#include "replay/settings.h"
#include "replay/work_recorder.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// All counters of one frame, or of several.
struct FrameCounters {
  frontend::FrontendCounters frontend;
  binner::BinnerCounters binner;
  tilecore::TessellationCounters tessellation;
  tilecore::TileCoreCounters tilecore;
  tilecore::ShadingCounters shading;
  tilecore::ResolveCounters resolve;
  tilecore::TextureCounters texture;
  L2Counters l2;
  hardware::Ledger ledger;

  // Joins the counters of a further frame into a total.
  void accumulate(const FrameCounters& frame);
};

// Calls visit(struct) for each counter struct.
template <class Counters, class Visit>
void for_each_counter_struct(Counters& counters, const Visit& visit) {
  visit(counters.frontend);
  visit(counters.binner);
  visit(counters.tessellation);
  visit(counters.tilecore);
  visit(counters.shading);
  visit(counters.resolve);
  visit(counters.texture);
  visit(counters.l2);
}

// Which effects a frame needed, in order of their names.
using FrameEffects = std::map<std::string, bool>;

// Cycles and energy of a frame on the described machine, and how they came about.
struct MachineModel {
  FrameRecord record;
  hardware::Schedule schedule;
  hardware::FrameTiming timing;
  hardware::FrameEnergy energy;
};

struct FrameResult {
  int frame = 0;
  tilecore::FrameTargets targets;
  FrameCounters counters;
  FrameEffects effects;
  std::map<std::string, double> stage_seconds;  // host time
  double seconds = 0;
  std::optional<BaselineSet> baselines;
  std::optional<MachineModel> model;  // with output.machine_model
};

// What to render of a capture.
struct RenderRequest {
  int width = 0, height = 0;
  IntRect region;          // pixels; whole frame by default
  bool auxiliary = false;
  bool baselines = false;  // run the other schemes as well
  bool record_accesses = false;  // keep every transfer over the memory interface, for traces
};

// Sends frames of a capture through the machine: front end, binner, tile cores, resolve. Pictures are independent of each
// other and of the number of threads; so are counters, but for frontend.previous_depth_culling, which looks at the
// frame rendered before when that was the one before.
class FrameRenderer {
 public:
  // `capture` must outlive the renderer.
  FrameRenderer(const frontend::Capture& capture, const hardware::GpuConfiguration& gpu, const RunSettings& settings,
                const RenderRequest& request);

  FrameResult render(int frame);

  // Whether the camera was made up because the capture has none.
  bool automatic_camera() const { return camera_.node == frontend::kNone; }
  const frontend::Assembly& assembly() const { return assembly_; }
  // Cache lines of all textures, displacement maps last.
  std::uint64_t texture_lines() const { return displacement_memory_.end(); }

 private:
  frontend::FrameRequest frame_request(int frame) const;
  tilecore::TileJob make_job(const frontend::FrameGeometry& frame, const binner::TileGrid& grid, const tilecore::SamplePattern& pattern) const;
  // The machine of `gpu` from the front end on; adds to `result`, to `recorder` and, unless null, to `record`.
  void run_machine(const hardware::GpuConfiguration& gpu, const frontend::OcclusionGuess* guess, const tilecore::TileJob& job, WorkRecorder& recorder, FrameResult& result, MachineRecord* record);
  // Bins, renders and finishes tiles: all of them, or those that `only` marks.
  void run_tiles(const tilecore::TileJob& job, binner::Binner& binner, std::span<const frontend::BoundedSubPatch> sub_patches,
                 const std::vector<bool>& only, tilecore::TessellationCache& cache, WorkRecorder& recorder, FrameResult& result, MachineRecord* record);
  // Renders again the tiles where something that the previous frame's depth hid is visible after all.
  void render_revived(const tilecore::TileJob& job, binner::Binner& binner, frontend::FrontEndResult& front_end, tilecore::TessellationCache& cache,
                      WorkRecorder& recorder, FrameResult& result, MachineRecord* record);
  void collect(const binner::Binner& binner, const tilecore::TessellationCache& cache, WorkRecorder& recorder, FrameResult& result);
  frontend::CoarseDepth coarse_depth(const tilecore::TileJob& job, const FrameResult& result) const;
  BaselineSet run_baselines(const tilecore::TileJob& job, const FrameResult& result, const MachineRecord& record);
  FrameEffects effects_of(const frontend::FrameGeometry& frame) const;

  const frontend::Capture& capture_;
  hardware::GpuConfiguration gpu_;
  RunSettings settings_;
  RenderRequest request_;
  frontend::Assembly assembly_;
  frontend::PyramidLibrary pyramids_;
  tilecore::TextureMemory texture_memory_;
  DisplacementMemory displacement_memory_;
  frontend::CameraChoice camera_;
  PerThread<tilecore::TileCore> cores_;
  std::optional<frontend::CoarseDepth> last_depth_;  // of frame last_frame_, where the next may use it
  int last_frame_ = 0;
};

}  // namespace tessera::replay
