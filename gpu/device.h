#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/rect.h"
#include "gpu/attachment_stores.h"
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
#include "gpu/taa.h"
#include "gpu/view_observer.h"
#include "gpu/work_progress.h"

namespace tessera::gpu {

// The parts of a capture to render, and the results to keep.
struct RenderRequest {
  int width = 0, height = 0;
  IntRect region;  // pixels; whole frame by default
  bool auxiliary = false;
  bool record_accesses = false;    // keeps every transfer over the memory interface, by the unit that asked for it
  bool keep_transactions = false;  // MachineModel::transactions, where memory.model=banks times the frame
  bool record_items = false;       // keeps every sub-patch and warp, for records; machine.timing=events does as well
  bool resolve_auxiliary = false;  // images of the resolve unit's decisions; with desampling only
  bool attribute = false;          // shares of drawables and tiles in the frame; keeps items. With output.machine_model
  bool error = false;              // their shares in its error, too: renders every frame fully as well
  std::optional<scene::CameraChoice> camera{};  // replaces the capture's own camera
  bool pixel_ids = false;                       // FrameTargets::ids: the surface that each pixel shows
};

// The machine put together: sends frames of a capture through front end, binner, tile cores and resolve. Images and
// counters do not depend on the number of threads. They do not depend on frames before, either, except with
// frontend.previous_depth_culling, frame_buffer.transaction_elimination and tile.rendering_elimination (counters) and
// resolve.desampling=adaptive and the temporal antialiasing of a capture (both), which use the last rendered frame if it is
// the previous one. If a surface
// transmits, any tile may show pixels of any other, so frames are whole, without desampling, previous_depth_culling and
// rendering_elimination. Devices share no mutable state: several may render at once, each on a thread of its own.
class Device {
 public:
  // `capture` must outlive the device.
  Device(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
         const RenderRequest& request)
      : Device(std::make_shared<const PreparedCapture>(capture), gpu, settings, request) {}
  // Throws UsageError for a region of frames in which a surface transmits, and the errors of FrameGraph.
  Device(std::shared_ptr<const PreparedCapture> prepared, const GpuConfiguration& gpu, const RunSettings& settings,
         const RenderRequest& request);

  FrameResult render(int frame);

  // Gives frames 1/`parts` of the memory that reading the capture left; `parts` is 1 unless other devices render at
  // once.
  void share_memory(std::size_t parts) { memory_parts_ = parts; }

  // Progress of the current frame; any thread may read it.
  const WorkProgress& progress() const { return progress_; }

  // Ends the current frame, and any later one, at its next tile; render() throws Abandoned. Any thread may call it.
  void abandon() { progress_.abandon(); }

  // Sets the observer of the views of each frame; nullptr removes it. The observer must outlive the device or the next
  // call. Throws UsageError where a comparison of machines would leave work out: with the exact layout of
  // the G-buffer, if tiles are eliminated, or if a pass loads the compressed frame before.
  void set_observer(ViewObserver* observer);

  // The history that the last rendered frame leaves to the next, with resolve.desampling=adaptive. set_history()
  // continues from the history of another replay.
  const tilecore::History& history() const { return eyes_[0].sequence.history(); }
  void set_history(tilecore::History history);

  // Storage format of pixels, without the state that a frame leaves to the next.
  tilecore::FrameStore frame_store() const;
  // Whether the camera was made up, because the capture has none.
  bool automatic_camera() const { return camera_.node == scene::kNone; }
  const scene::Assembly& assembly() const { return scene_.assembly; }
  // Size of the scene-color image, mip chain included.
  std::uint64_t scene_color_bytes() const;
  // One more than the last cache line of all textures; displacement maps come last.
  std::uint64_t texture_lines() const { return displacement_memory_.end(); }
  // Number of cache lines of records for the pixel shader.
  std::uint64_t record_lines() const { return patch_table_.end() - patch_table_.first_line(); }

 private:
  // A rendered view of the scene, and the state that its frames leave to each other.
  struct ViewState {
    scene::CameraChoice camera;
    ResolveSequence sequence;
    std::shared_ptr<const scene::FrameGeometry> pose{};  // of the last rendered frame, if it is worth its memory
    // Content of its frame buffer and the signatures of its inputs; of frame `kept`.
    tilecore::StoredFrame stored{};
    InputSignatures inputs{};
    std::vector<std::uint16_t> payloads{};  // FrameStore::payloads
    AttachmentStores attachments{};
    StoredArrays arrays{};
    std::optional<int> kept{};
    TaaHistory taa{};
  };

  scene::FrameRequest frame_request(int frame) const;
  tilecore::TileJob make_job(const scene::FrameGeometry& frame, const binner::TileGrid& grid,
                             const tilecore::SamplePattern& pattern);
  // Brings the state of the previous frame into `job`, if tiles may be eliminated.
  void begin_elimination(int frame, ViewState& eye, tilecore::TileJob& job) const;
  void end_elimination(ViewState& eye, const FrameResult& result) const;
  // The sparse pass of the sampling controller; nullptr if ordinary patches draw the procedures, or if there are none.
  std::unique_ptr<tilecore::ParameterMaps> map_procedures(const tilecore::TileJob& job, FrameResult& result) const;
  // Prepares the history for the next frame as the frame buffer stores it. `whole`: it has all of the frame's pixels.
  void prepare_history(tilecore::History& history, bool whole) const;
  // The resolve unit's input in this view. `left`: the pose of the finished left eye, for the right one.
  tilecore::ResolveFrame& begin_resolve(int frame, ViewState& eye, const scene::FrameGeometry& geometry,
                                        const scene::FrameGeometry* left, FrameResult& result);
  // The pose of a view's frame, which `eye` keeps for the next one. `notes`: `result` gets a note where curved motion has
  // too few segments.
  std::shared_ptr<const scene::FrameGeometry> pose_view(int frame, ViewState& eye, bool notes,
                                                        FrameResult& result) const;
  // Ends the recording of a view, and adds its time, energy and shares to `result`.
  void model_view(int frame, WorkRecorder& recorder, FrameResult& result);
  // Renders one view into `result`.
  std::shared_ptr<const scene::FrameGeometry> render_view(int frame, ViewState& eye, const scene::FrameGeometry* left,
                                                          FrameResult& result);
  void render_right_eye(int frame, const scene::FrameGeometry& left, FrameResult& result);
  // Renders the same frame fully and writes the difference to result.targets.error.
  void measure_error(const tilecore::TileJob& job, FrameResult& result);

  std::shared_ptr<const PreparedCapture> prepared_;
  const PreparedScene& scene_;  // of prepared_
  RunSettings settings_;
  GpuConfiguration gpu_;
  RenderRequest request_;
  FrameGraph graph_;
  shaders::RadianceImage behind_;  // without levels if no surface transmits
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
  std::optional<frontend::CoarseDepth> last_depth_;  // of frame last_frame_, if the next may use it
  int last_frame_ = 0;
  std::size_t memory_parts_ = 1;
  CachesOfFrames caches_;
  WorkProgress progress_;
};

}  // namespace tessera::gpu
