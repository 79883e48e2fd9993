#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "scene/frame_geometry.h"
#include "tilecore/resolve/resolve_unit.h"

namespace tessera::gpu {

// By the name of an effect: why it ran in a frame or did not.
using EffectReasons = std::map<std::string, std::string>;

// Prepares the resolve unit for frame after frame of one eye, and keeps the state that one frame leaves to the next:
// its History, and its pose, which gives the previous places of vertices.
class ResolveSequence {
 public:
  ResolveSequence(const tilecore::ResolveSettings& settings, IntRect region);

  // Whether frame `number` could use a pose of the previous frame that is not kept here; the caller then passes it to
  // begin().
  bool wants_previous_pose(int number) const;

  // Begins the frame that the tile cores work on. `geometry` is its pose; if `previous_pose` is nullptr the last
  // frame's pose is used, provided it was the previous one. `focus`: focus of the gaze, in frame widths and heights.
  // The result is valid until finish().
  tilecore::ResolveFrame& begin(int number, const scene::FrameGeometry& geometry,
                                std::shared_ptr<const scene::FrameGeometry> previous_pose, DVec2 focus,
                                EffectReasons& reasons);
  // For a left eye: a right one takes pixels from its frames, if desampling is adaptive. Call it before the first
  // begin().
  void serve_other_eye() { read_by_other_eye_ = settings_.desampling == tilecore::Desampling::kAdaptive; }
  // For a right eye: `other` is the finished left one. Call it after begin().
  void advect_from_other_eye(const scene::FrameGeometry& geometry, const scene::FrameGeometry& other,
                             const tilecore::History& history, float far_depth);

  // Finishes the frame: from now on history() is its history.
  void finish();
  // Keeps the frame's pose for the next frame.
  void keep_pose(std::shared_ptr<const scene::FrameGeometry> pose) { pose_ = std::move(pose); }

  // History of the last finished frame; empty before the first.
  const tilecore::History& history() const { return histories_[last_]; }
  // Continues from a history of another replay. Throws UsageError if its region differs.
  void set_history(tilecore::History history);

 private:
  tilecore::ResolveSettings settings_;
  IntRect region_;
  bool read_by_other_eye_ = false;
  tilecore::History histories_[2];
  std::size_t last_ = 0;
  std::shared_ptr<const scene::FrameGeometry> pose_;  // of the last finished frame
  std::unique_ptr<tilecore::MotionField> motion_, eye_motion_;
  tilecore::ResolveFrame frame_;
};

}  // namespace tessera::gpu
