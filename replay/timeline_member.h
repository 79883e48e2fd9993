#pragma once

#include <string>

#include "gpu/frame_timeline.h"

namespace tessera::replay {

// A member of tiles_NNNN.json, with a comma behind it: the frame in time, in whole cycles (of a stereo pair, the left
// eye).
//   "timeline": {"cycles", "slots", "windows", "geometry": [[bound begin, end, bin begin, end], ... by round],
//                "tile", "core", "slot", "begin": [one of each tile in the scheduler's order],
//                "spans": [eight durations of each tile: waits for data, visibility, waits for a unit, for data, shading,
//                waits for a unit, for data, store],
//                "bytes": {source: [by window]}, "busy": {unit: [percent, by window]}, "list_bytes": [most, by window]}
// Sources, units and windows that hold nothing are left out.
std::string timeline_member(const gpu::FrameTimeline& timeline);

}  // namespace tessera::replay
