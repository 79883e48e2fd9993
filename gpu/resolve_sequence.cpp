#include "gpu/resolve_sequence.h"

#include <fmt/format.h>

#include "base/error.h"
#include "tilecore/resolve/motion_field.h"

namespace tessera::gpu {

using tilecore::History;
using tilecore::MotionField;

namespace {

// The reason why no pixel comes from the previous frame, when tilecore::advects() is false.
std::string no_advection(const tilecore::ResolveSettings& s) {
  if (s.desampling != tilecore::Desampling::kAdaptive) return "one rate everywhere needs no motion and no history";
  return s.advect ? "resolve.reuse_speed is 0: nothing is slower" : "resolve.advection=false";
}

}  // namespace

ResolveSequence::ResolveSequence(const tilecore::ResolveSettings& settings, IntRect region)
    : settings_(settings), region_(region) {
  frame_.settings = settings;
}

bool ResolveSequence::wants_previous_pose(int number) const {
  return settings_.desampling == tilecore::Desampling::kAdaptive && !history().empty() &&
         history().frame == number - 1 && !pose_;
}

tilecore::ResolveFrame& ResolveSequence::begin(int number, const scene::FrameGeometry& geometry,
                                               std::shared_ptr<const scene::FrameGeometry> previous_pose, DVec2 focus,
                                               EffectReasons& reasons) {
  if (previous_pose) pose_ = std::move(previous_pose);
  History& next = histories_[1 - last_];
  if (next.region != region_) next = History(region_);
  next.frame = number;
  frame_.settings.edges.orthographic = geometry.projection.orthographic;
  frame_.creases = {settings_.edge_angle, geometry.projection};
  frame_.foveation = {settings_.foveation, focus, geometry.request.width, geometry.request.height};
  frame_.number = static_cast<std::uint32_t>(number);
  frame_.next = &next;
  frame_.previous = frame_.other_eye = {};
  frame_.cut = false;
  next.camera = {};
  motion_.reset();
  eye_motion_.reset();
  frame_.origin.resize(next.color.size());
  frame_.deferred.resize(next.memory.size());
  frame_.written.assign(next.memory.size(), 0);
  const bool adaptive = settings_.desampling == tilecore::Desampling::kAdaptive;
  const bool advects = tilecore::advects(settings_);
  frame_.keeps_records = advects || read_by_other_eye_;
  reasons["history"] =
      advects                ? "kept for the advection of the next frame"
      : frame_.keeps_records ? "kept for the right eye"
      : tilecore::reads_blocks(settings_)
          ? "a byte per block for the hysteresis; no unit reads records of pixels: " + no_advection(settings_)
      : tilecore::reads_contrast(settings_)
          ? "a byte per block of contrast; no unit reads records of pixels: " + no_advection(settings_)
          : "not kept: " + no_advection(settings_);
  reasons["desampling"] = adaptive ? "resolve.desampling=adaptive" : "resolve.desampling asks for one rate everywhere";
  std::string& advection = reasons["advection"];
  std::string& velocity = reasons["velocity"];
  if (!adaptive) {
    advection = velocity = no_advection(settings_);
  } else if (history().empty()) {
    advection = velocity = "first frame: there is no history";
  } else if (history().frame != number - 1 || !pose_) {
    advection = velocity = "the frame before was not rendered: there is no history";
  } else {
    motion_ = std::make_unique<MotionField>(geometry, *pose_);
    frame_.previous = {&history(), motion_.get()};
    next.camera = tilecore::camera_motion(geometry, *pose_, history());
    frame_.cut = settings_.rates.thresholds.cut > 0 &&
                 tilecore::is_cut(history().camera, next.camera, settings_.rates.thresholds.cut);
    if (frame_.cut) reasons["desampling"] += "; a cut: fast blocks are shaded fully";
    velocity = motion_->all_still() ? "nothing moved since the last frame: zero without evaluation"
                                    : "evaluated where something moved";
    if (!advects)
      advection = no_advection(settings_);
    else if (motion_->lights().everywhere())
      advection = "a light that reaches everything changed";
    else
      advection = motion_->lights().none()
                      ? "blocks slower than resolve.reuse_speed"
                      : "blocks slower than resolve.reuse_speed, out of reach of the lights that changed";
  }
  return frame_;
}

void ResolveSequence::advect_from_other_eye(const scene::FrameGeometry& geometry, const scene::FrameGeometry& other,
                                            const History& history, float far_depth) {
  if (settings_.desampling != tilecore::Desampling::kAdaptive) return;
  eye_motion_ = std::make_unique<MotionField>(geometry, other);
  frame_.other_eye = {&history, eye_motion_.get()};
  frame_.other_eye_depth = far_depth;
}

void ResolveSequence::finish() {
  motion_.reset();
  eye_motion_.reset();
  last_ = 1 - last_;
  pose_.reset();
}

void ResolveSequence::set_history(History history) {
  if (history.region != region_)
    throw UsageError(fmt::format("the history is of {}x{} pixels from ({}, {}), the replay of {}x{} from ({}, {})",
                                 history.region.width(), history.region.height(), history.region.x0, history.region.y0,
                                 region_.width(), region_.height(), region_.x0, region_.y0));
  histories_[last_] = std::move(history);
  pose_.reset();
}

}  // namespace tessera::gpu
