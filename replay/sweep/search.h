#pragma once

#include <functional>
#include <string>
#include <vector>

#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {

// Runs a study with a goal in generations of candidates (unit_samples.h). A candidate is the coordinates of a point
// along the axes; run_sweep() makes it and goal.h scores it. A candidate that hits an earlier point takes that point's
// result. The search ends when it has as many points as the goal wants, for each capture, or when kIdleGenerations
// consecutive generations had no new point.
//
// Invariants (cited by the tests):
//   GS1  The points depend on the study, the captures and the program alone: a search that was killed goes through the
//        same generations again, and finds their results.
//   GS2  Nothing is rendered for a candidate whose function (SweepPoint::function) was rendered before.
struct SearchResult {
  SweepOutcome outcome;
  std::vector<SweepPoint> points;  // candidate by candidate, capture by capture
  std::size_t generations = 0;
};
inline constexpr std::size_t kIdleGenerations = 30;

// Adds the candidates to `study`. `shown` receives the points so far before each generation is made.
SearchResult run_search(Study& study, const std::string& program, const SweepFolder& folder,
                        const SweepOptions& options, CaptureLibrary& library,
                        const std::function<void(const std::vector<SweepPoint>&)>& shown);

}  // namespace tessera::replay
