#pragma once

#include "scene/view.h"
#include "tilecore/resolve/foveation.h"

namespace tessera::gpu {

// The focus of the gaze in each frame: a place of the settings, or a node of the capture.
class MovingFocus {
 public:
  // `capture` must outlive the focus. Throws UsageError if the scene has no node of that name, or several.
  MovingFocus(const tilecore::FoveationSettings& settings, const scene::Capture& capture);

  // The focus at `seconds`, the middle of a frame's shutter, through the camera of an eye: in frame widths and heights.
  // A node is seen through the lens centre; if it lies in the camera's plane or behind it, the settings' place is
  // returned.
  DVec2 at(double seconds, const scene::CameraChoice& camera, int width, int height) const;

 private:
  DVec2 fixed_;
  const scene::Capture* capture_;
  int node_ = scene::kNone;
};

}  // namespace tessera::gpu
