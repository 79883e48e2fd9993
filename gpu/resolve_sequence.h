#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "scene/frame_geometry.h"
#include "tilecore/resolve/resolve_unit.h"

namespace tessera::gpu {

// Why an effect ran in a frame, or did not, by its name.
using EffectReasons = std::map<std::string, std::string>;

// Prepares the resolve unit for frame after frame of one eye, and keeps what one frame leaves to the next: its History,
// and its pose, from which follows where vertices were.
class ResolveSequence {
 public:
  ResolveSequence(const tilecore::ResolveSettings& settings, IntRect region);

  // Whether frame `number` could use a pose of the frame before that is not at hand; then the caller gives it to
  // begin().
  bool wants_previous_pose(int number) const;

  // The frame that the tile cores work on from now on. `geometry` is its pose; `previous_pose` null: that of the last
  // frame, if it was the one before. `focus`: where the eye looks, in frame widths and heights. Valid until finish().
  tilecore::ResolveFrame& begin(int number, const scene::FrameGeometry& geometry,
                                std::shared_ptr<const scene::FrameGeometry> previous_pose, DVec2 focus,
                                EffectReasons& reasons);
  // Of a left eye: a right one takes pixels from its frames, if desampling is adaptive. Call before the first begin().
  void serve_other_eye() { read_by_other_eye_ = settings_.desampling == tilecore::Desampling::kAdaptive; }
  // For a right eye: the finished left one. Call after begin().
  void advect_from_other_eye(const scene::FrameGeometry& geometry, const scene::FrameGeometry& other,
                             const tilecore::History& history, float far_depth);

  // The frame is finished: history() is its own from now on.
  void finish();
  // Its pose, for the next frame.
  void keep_pose(std::shared_ptr<const scene::FrameGeometry> pose) { pose_ = std::move(pose); }

  // Of the frame that was finished last; empty before the first.
  const tilecore::History& history() const { return histories_[last_]; }
  // Goes on from a history of another replay. Throws UsageError when its region is not this one's.
  void set_history(tilecore::History history);

 private:
  tilecore::ResolveSettings settings_;
  IntRect region_;
  bool read_by_other_eye_ = false;
  tilecore::History histories_[2];
  std::size_t last_ = 0;
  std::shared_ptr<const scene::FrameGeometry> pose_;  // of the frame that was finished last
  std::unique_ptr<tilecore::MotionField> motion_, eye_motion_;
  tilecore::ResolveFrame frame_;
};

}  // namespace tessera::gpu
