#pragma once

#include <string>
#include <vector>

#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {

// What a run would do and how long it would take: `--dry-run`. Writes nothing.
struct SweepEstimate {
  std::size_t points = 0, found = 0, renders = 0, timings = 0, refused = 0;
  // Of a frame of the first point to be rendered of each capture, measured now; means over captures. 0 without.
  double render_seconds = 0, timing_seconds = 0;
  std::size_t workers = 1;
  double seconds = 0;  // wall clock, of all frames, by their pixels
};

SweepEstimate estimate_sweep(const Study& study, const std::vector<SweepPoint>& points,
                             const std::vector<std::size_t>& mine, const SweepFolder& folder,
                             const SweepOptions& options, CaptureLibrary& library);

// Of a goal: a Latin hypercube of as many candidates as it wants stands for those that it will come upon.
std::vector<SweepPoint> expected_points(Study& study, const std::string& program);

}  // namespace tessera::replay
