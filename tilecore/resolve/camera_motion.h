#pragma once

#include <array>

#include "scene/frame_geometry.h"
#include "tilecore/resolve/history.h"

namespace tessera::tilecore {

// By how many pixels each of History::kCameraPlaces places of the previous frame, `then`, is elsewhere in `now` because
// the camera moved: what rests there in the scene, at the depth that `history` has. Infinite: behind the eye now.
CameraMotion camera_motion(const scene::FrameGeometry& now, const scene::FrameGeometry& then, const History& history);

// Whether the camera's motion is another than it was, by more than `pixels` in most places: a cut, or it stops or starts.
// The eye has followed nothing that moves now, so that it sees coarser shading of it. Not where either is unknown.
bool is_cut(const CameraMotion& before, const CameraMotion& now, float pixels);

}  // namespace tessera::tilecore
