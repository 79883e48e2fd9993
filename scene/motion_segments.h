#pragma once

#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// How a shutter is cut where motion is curved. Motion is linear between motion keys; of a joint that turns, two keys
// leave the chord.
struct SegmentPlan {
  int count = 1;             // 1: nothing is cut
  std::vector<bool> curved;  // as Assembly::drawables; empty with one segment
};

// For a frame whose whole shutter is posed. Each drawable's points (64 of them at most) are compared at a quarter, the
// middle and three quarters of the shutter with where linear motion has them on screen. A chord's distance from its arc
// falls with the square of the segments: an error of e pixels needs sqrt(e / motion_error) of them. With a given number,
// curved is what is farther off than a sub-pixel. A camera that zooms needs segments at all: a single one keeps the
// projection of shutter open. What is off the screen all the time is not asked.
SegmentPlan plan_segments(const FrameGeometry& frame, const CameraChoice& camera);

}  // namespace tessera::scene
