#pragma once

#include <functional>
#include <string>
#include <vector>

#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {

// A study with a goal: generations of candidates (unit_samples.h), each the coordinates of a point along the
// axes, made by run_sweep() and scored (goal.h). A candidate that fell on a point before is that point. Ends with as
// many points as the goal wants, for each capture, or when kIdleGenerations in turn brought none that is new.
//
// Invariants (cited by the tests):
//   GS1  The points follow from the study, the captures and the program alone: a search that was killed goes through
//        the same generations again, and finds their results.
//   GS2  Nothing is rendered for a candidate whose function (SweepPoint::function) was rendered before.
struct SearchResult {
  SweepOutcome outcome;
  std::vector<SweepPoint> points;  // candidate by candidate, capture by capture
  std::size_t generations = 0;
};
inline constexpr std::size_t kIdleGenerations = 30;

// Adds the candidates to `study`. `shown`: called with the points so far before each generation is made.
SearchResult run_search(Study& study, const std::string& program, const SweepFolder& folder,
                        const SweepOptions& options, CaptureLibrary& library,
                        const std::function<void(const std::vector<SweepPoint>&)>& shown);

}  // namespace tessera::replay
