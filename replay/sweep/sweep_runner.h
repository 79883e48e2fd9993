#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "replay/sweep/points.h"
#include "replay/sweep/study.h"
#include "replay/sweep/sweep_folder.h"

namespace tessera::replay {

struct SweepOptions {
  std::size_t shard = 0, shards = 1;                 // renders the points p with p % shards == shard
  std::size_t threads = 1;                           // host threads in all
  std::size_t jobs = 1;                              // most points at once
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of a capture; of all images in work
  bool strict = false;                               // scene::CaptureLimits::strict
  bool quiet = false;
};

// What a run of a sweep did. Host times, for people.
struct SweepOutcome {
  std::size_t mine = 0, found = 0,
              rendered = 0;     // points of this shard: all, those that were there before, those made now
  std::size_t timed_again = 0;  // of those made now: from the record of another that differs in timing keys only
  std::size_t workers = 0;
  double seconds = 0;         // wall clock, from the first capture to the last result
  double render_seconds = 0;  // of all workers together: inside the machine
  double load_seconds = 0;    // reading captures
  bool stopped = false;       // by a signal; results so far are there
};

// Renders the points whose results are not there yet: several at once, each on its share of the threads. Ctrl-C
// finishes the points in hand. Throws what reading a capture and writing a result throw, and LimitError when the
// images of one point exceed the limit; values that a machine cannot have become the point's fault, not the sweep's.
SweepOutcome run_sweep(const Study& study, const std::vector<SweepPoint>& points, const SweepFolder& folder,
                       const SweepOptions& options);

}  // namespace tessera::replay
