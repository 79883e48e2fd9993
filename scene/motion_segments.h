#pragma once

#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// How a shutter is cut where motion is curved. Motion between two motion keys is linear: for a joint that turns, two
// keys describe only the chord.
struct SegmentPlan {
  std::vector<ShutterSegment> parts;  // consecutive parts of the whole shutter; empty: nothing is cut
  std::vector<bool> curved;           // as Assembly::drawables; empty where nothing is cut
  std::vector<bool> jumps;  // per part: some place at its begin differs from the place at the end of the previous part
  double error = 0;         // pixels: largest distance of any piece of smooth motion from its curve, at any time
};

// Plans the segments of a frame whose whole shutter is posed. The bounds of motion_curves.h decide where pieces end:
// each is as long as FrameRequest::motion_error allows, with at most motion_segments_max of them; if these do not
// suffice, the plan has the least error for that number. Where that error exceeds four times motion_error, pieces get
// different lengths, so that no periodic motion can hide between their ends. A given number of segments is an upper
// limit, and the plan has the least error for it; drawables that are farther off than a sub-pixel are then curved. A
// cut lies at every jump and at every flip of the winding. A zooming camera always needs segments, because a single one
// keeps the projection of shutter open. Drawables that are off the screen all the time are ignored.
SegmentPlan plan_segments(const FrameGeometry& frame, const CameraChoice& camera);

}  // namespace tessera::scene
