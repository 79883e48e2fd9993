#pragma once

#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// How a shutter is cut where motion is curved. Motion is linear between motion keys; of a joint that turns, two keys
// leave the chord.
struct SegmentPlan {
  std::vector<ShutterSegment> parts;  // one after the other, the whole shutter; empty: nothing is cut
  std::vector<bool> curved;           // as Assembly::drawables; empty where nothing is cut
  std::vector<bool> jumps;            // as parts: places at its begin are not those at the end of the part before
  double error = 0;                   // pixels: no even piece of motion is farther from its curve at any time
};

// For a frame whose whole shutter is posed. Pieces end where the bounds of motion_curves.h say: each is as long as it
// may be for FrameRequest::motion_error, at most motion_segments_max of them; then the error is as small as so many
// allow. Where that is more than four times motion_error, pieces do not have one length, so that no repetition of a
// motion can hide between their ends. With a given number of segments there are no more than so many, with the least error; curved is then what is farther off than a
// sub-pixel. What jumps, and what is turned inside out, is cut there. A camera that zooms needs segments at all: a
// single one keeps the projection of shutter open. What is off the screen all the time is not asked.
SegmentPlan plan_segments(const FrameGeometry& frame, const CameraChoice& camera);

}  // namespace tessera::scene
