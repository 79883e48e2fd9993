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
#include "hardware/ledger.h"
#include "replay/baselines.h"
#include "replay/settings.h"
#include "replay/tile_maps.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// All counters of one frame, or of several.
struct FrameCounters {
  frontend::FrontendCounters frontend;
  binner::BinnerCounters binner;
  tilecore::TessellationCounters tessellation;
  tilecore::TileCoreCounters tilecore;
  tilecore::StencilCounters stencil;
  tilecore::RayCounters rays;
  tilecore::ShadingCounters shading;
  tilecore::ResolveCounters resolve;
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
  visit(counters.stencil);
  visit(counters.rays);
  visit(counters.shading);
  visit(counters.resolve);
}

// Which effects a frame needed, in order of their names.
using FrameEffects = std::map<std::string, bool>;

struct FrameResult {
  int frame = 0;
  tilecore::FrameTargets targets;
  FrameCounters counters;
  FrameEffects effects;
  std::map<std::string, double> stage_seconds;  // host time
  double seconds = 0;
  std::optional<BaselineSet> baselines;
  TileMaps maps{};
};

// What all replays of one capture share, whatever the machine and the settings. Read only: many renderers may use it at once.
struct PreparedCapture {
  // `capture_in` must outlive it.
  explicit PreparedCapture(const frontend::Capture& capture_in) : capture(capture_in), assembly(frontend::assemble(capture_in)), pyramids(assembly) {}

  const frontend::Capture& capture;
  const frontend::Assembly assembly;
  const frontend::PyramidLibrary pyramids;
};

// What to render of a capture.
struct RenderRequest {
  int width = 0, height = 0;
  IntRect region;          // pixels; whole frame by default
  bool auxiliary = false;
  bool baselines = false;  // run the other schemes as well
};

// Sends frames of a capture through the machine: front end, binner, tile cores, resolve. Pictures are independent of each
// other and of the number of threads; so are counters, but for frontend.previous_depth_culling, which looks at the
// frame rendered before when that was the one before.
class FrameRenderer {
 public:
  // `capture` must outlive the renderer.
  FrameRenderer(const frontend::Capture& capture, const hardware::GpuConfiguration& gpu, const RunSettings& settings,
                const RenderRequest& request)
      : FrameRenderer(std::make_shared<const PreparedCapture>(capture), gpu, settings, request) {}
  FrameRenderer(std::shared_ptr<const PreparedCapture> prepared, const hardware::GpuConfiguration& gpu, const RunSettings& settings,
                const RenderRequest& request);

  FrameResult render(int frame);

  // Whether the camera was made up because the capture has none.
  bool automatic_camera() const { return camera_.node == frontend::kNone; }
  const frontend::Assembly& assembly() const { return assembly_; }

 private:
  frontend::FrameRequest frame_request(int frame) const;
  tilecore::TileJob make_job(const frontend::FrameGeometry& frame, const binner::TileGrid& grid, const tilecore::SamplePattern& pattern) const;
  // The machine of `gpu` from the front end on; adds to `result` and, unless null, to `record`.
  void run_machine(const hardware::GpuConfiguration& gpu, const frontend::OcclusionGuess* guess, const tilecore::TileJob& job, FrameResult& result, MachineRecord* record);
  // Bins, renders and finishes tiles: all of them, or those that `only` marks.
  void run_tiles(const tilecore::TileJob& job, binner::Binner& binner, std::span<const frontend::BoundedSubPatch> sub_patches,
                 const std::vector<bool>& only, tilecore::TessellationCache& cache, FrameResult& result, MachineRecord* record);
  // Renders again the tiles where something that the previous frame's depth hid is visible after all.
  void render_revived(const tilecore::TileJob& job, binner::Binner& binner, frontend::FrontEndResult& front_end, tilecore::TessellationCache& cache,
                      FrameResult& result, MachineRecord* record);
  void collect(const binner::Binner& binner, const tilecore::TessellationCache& cache, FrameResult& result);
  frontend::CoarseDepth coarse_depth(const tilecore::TileJob& job, const FrameResult& result) const;
  BaselineSet run_baselines(const tilecore::TileJob& job, const FrameResult& result, const MachineRecord& record);
  FrameEffects effects_of(const frontend::FrameGeometry& frame) const;

  std::shared_ptr<const PreparedCapture> prepared_;
  const frontend::Capture& capture_;
  hardware::GpuConfiguration gpu_;
  RunSettings settings_;
  RenderRequest request_;
  const frontend::Assembly& assembly_;
  const frontend::PyramidLibrary& pyramids_;
  frontend::CameraChoice camera_;
  PerThread<tilecore::TileCore> cores_;
  std::optional<frontend::CoarseDepth> last_depth_;  // of frame last_frame_, where the next may use it
  int last_frame_ = 0;
};

}  // namespace tessera::replay
