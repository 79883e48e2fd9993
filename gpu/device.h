#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/rect.h"
#include "gpu/configuration.h"
#include "gpu/displacement_memory.h"
#include "gpu/frame_graph.h"
#include "gpu/frame_result.h"
#include "gpu/moving_focus.h"
#include "gpu/patch_table.h"
#include "gpu/pipeline.h"
#include "gpu/prepared_capture.h"
#include "gpu/resolve_sequence.h"
#include "gpu/settings.h"
#include "gpu/shadow_passes.h"
#include "gpu/view_observer.h"
#include "gpu/work_progress.h"

namespace tessera::gpu {

// What to render of a capture.
struct RenderRequest {
  int width = 0, height = 0;
  IntRect region;  // pixels; whole frame by default
  bool auxiliary = false;
  bool record_accesses = false;    // keep every transfer over the memory interface, by the unit that asked for it
  bool keep_transactions = false;  // MachineModel::transactions, where memory.model=banks times the frame
  bool record_items = false;       // keep every sub-patch and warp, for records; machine.timing=events does as well
  bool resolve_auxiliary = false;  // images of what the resolve unit did; with desampling only
  bool attribute = false;          // what drawables and tiles have of the frame; keeps items. With output.machine_model
  bool error = false;              // and of its error: renders every frame fully as well
  std::optional<scene::CameraChoice> camera{};  // through which frames are seen, instead of the capture's own
  bool pixel_ids = false;                       // FrameTargets::ids: what each pixel shows
};

// The machine put together: sends frames of a capture through front end, binner, tile cores and resolve. Images and
// counters do not depend on the number of threads; nor on frames before, but for frontend.previous_depth_culling,
// frame_buffer.transaction_elimination and tile.rendering_elimination (counters) and resolve.desampling=adaptive (both),
// which look at the frame rendered before when that was the one before. Where a surface transmits, frames are whole ones,
// without desampling, previous_depth_culling and rendering_elimination: any tile may see what is in any other. Devices share nothing that changes: several may
// render at once, each on a thread of its own.
class Device {
 public:
  // `capture` must outlive the device.
  Device(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
         const RenderRequest& request)
      : Device(std::make_shared<const PreparedCapture>(capture), gpu, settings, request) {}
  // Throws UsageError when a region is asked for of frames in which a surface transmits, and what FrameGraph throws.
  Device(std::shared_ptr<const PreparedCapture> prepared, const GpuConfiguration& gpu, const RunSettings& settings,
         const RenderRequest& request);

  FrameResult render(int frame);

  // Frames have one part in so many of the memory that reading the capture left; 1 unless others render at once.
  void share_memory(std::size_t parts) { memory_parts_ = parts; }

  // Of the frame in hand; may be read on any thread.
  const WorkProgress& progress() const { return progress_; }

  // On any thread: the frame in hand, and any later one, ends at its next tile; render() throws Abandoned.
  void abandon() { progress_.abandon(); }

  // Sets who observes the views of each frame; null stops that. The observer must outlive the device or the next call. Throws UsageError where tiles are eliminated, where
  // surfaces transmit and where a capture describes passes: who compares machines sees one that renders and writes all
  // tiles in one pass.
  void set_observer(ViewObserver* observer);

  // What the frame rendered last leaves to the next, with resolve.desampling=adaptive; and to go on from that of
  // another replay.
  const tilecore::History& history() const { return eyes_[0].sequence.history(); }
  void set_history(tilecore::History history);

  // How pixels are stored, without what a frame leaves to the next.
  tilecore::FrameStore frame_store() const;
  // Whether the camera was made up, and is none of the capture's.
  bool automatic_camera() const { return camera_.node == scene::kNone; }
  const scene::Assembly& assembly() const { return scene_.assembly; }
  // Of the image of what is behind surfaces that transmit, all levels.
  std::uint64_t scene_color_bytes() const;
  // Cache lines of all textures, displacement maps last.
  std::uint64_t texture_lines() const { return displacement_memory_.end(); }
  // And of records for the pixel shader.
  std::uint64_t record_lines() const { return patch_table_.end() - patch_table_.first_line(); }

 private:
  // A view of the scene that is rendered, and what its frames leave to each other.
  struct ViewState {
    scene::CameraChoice camera;
    ResolveSequence sequence;
    std::shared_ptr<const scene::FrameGeometry> pose{};  // of the frame rendered last, if it is worth its memory
    // What its frame buffer holds, and why; of frame `kept`.
    tilecore::StoredFrame stored{};
    InputSignatures inputs{};
    std::vector<std::uint16_t> payloads{};  // FrameStore::payloads
    std::optional<int> kept{};
  };

  scene::FrameRequest frame_request(int frame) const;
  tilecore::TileJob make_job(const scene::FrameGeometry& frame, const binner::TileGrid& grid,
                             const tilecore::SamplePattern& pattern);
  // What the frame before leaves to this one, where tiles may be eliminated.
  void begin_elimination(int frame, ViewState& eye, tilecore::TileJob& job) const;
  void end_elimination(ViewState& eye, const FrameResult& result) const;
  // The sparse pass of the sampling controller; null where ordinary patches draw the procedures, or there are none.
  std::unique_ptr<tilecore::ParameterMaps> map_procedures(const tilecore::TileJob& job, FrameResult& result) const;
  // What a frame leaves to the next, as it lies in the frame buffer. `whole`: all of its pixels are there.
  void prepare_history(tilecore::History& history, bool whole) const;
  // What the resolve unit works by in this view. `left`: the pose of the finished left eye, for the right one.
  tilecore::ResolveFrame& begin_resolve(int frame, ViewState& eye, const scene::FrameGeometry& geometry,
                                        const scene::FrameGeometry* left, FrameResult& result);
  // Renders one view into `result`.
  std::shared_ptr<const scene::FrameGeometry> render_view(int frame, ViewState& eye, const scene::FrameGeometry* left,
                                                          FrameResult& result);
  void render_right_eye(int frame, const scene::FrameGeometry& left, FrameResult& result);
  // Renders the same frame fully and writes the difference to result.targets.error.
  void measure_error(const tilecore::TileJob& job, FrameResult& result);

  std::shared_ptr<const PreparedCapture> prepared_;
  const PreparedScene& scene_;  // of prepared_
  GpuConfiguration gpu_;
  RunSettings settings_;
  RenderRequest request_;
  FrameGraph graph_;
  shaders::RadianceImage behind_;  // without levels where nothing transmits
  Pipeline::Cores cores_;
  ShadowPasses shadow_passes_;
  tilecore::TextureMemory texture_memory_;
  DisplacementMemory displacement_memory_;
  PatchTable patch_table_;
  scene::CameraChoice camera_;
  tilecore::ResolveSettings resolve_;
  MovingFocus focus_;
  std::vector<ViewState> eyes_;  // the left or only one, the right one
  Pipeline pipeline_;
  ViewObserver* observer_ = nullptr;
  std::optional<frontend::CoarseDepth> last_depth_;  // of frame last_frame_, where the next may use it
  int last_frame_ = 0;
  std::size_t memory_parts_ = 1;
  CachesOfFrames caches_;
  WorkProgress progress_;
};

}  // namespace tessera::gpu
