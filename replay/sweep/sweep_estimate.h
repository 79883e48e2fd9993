#pragma once

#include <string>
#include <vector>

#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {

// Work and duration of a planned run: `--dry-run`. Writes nothing.
struct SweepEstimate {
  std::size_t points = 0, found = 0, renders = 0, timings = 0, refused = 0;
  // Seconds of a frame, measured now with the first point to be rendered of each capture; means over captures. 0
  // without one.
  double render_seconds = 0, timing_seconds = 0;
  std::size_t workers = 1;
  double seconds = 0;  // wall clock for all frames, scaled by their pixels
};

SweepEstimate estimate_sweep(const Study& study, const std::vector<SweepPoint>& points,
                             const std::vector<std::size_t>& mine, const SweepFolder& folder,
                             const SweepOptions& options, CaptureLibrary& library);

// The points of a study with a goal are not known: a Latin hypercube of as many candidates as it wants stands for them.
std::vector<SweepPoint> expected_points(Study& study, const std::string& program);

}  // namespace tessera::replay
