#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "replay/sweep/capture_library.h"
#include "replay/sweep/points.h"
#include "replay/sweep/study.h"
#include "replay/sweep/sweep_folder.h"

namespace tessera::replay {

struct SweepOptions {
  std::size_t threads = 1;                           // host threads in all
  std::size_t jobs = 1;                              // most renders at once
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of a capture; of all images in work; of a record's frame
  bool strict = false;                               // scene::CaptureLimits::strict
  bool quiet = false;
};

// What a run of a sweep did. Host times, for people.
struct SweepOutcome {
  std::size_t mine = 0, found = 0, made = 0;  // points wanted, those that were there before, those made now
  // Those made now: rendered, timed from what one of these left, and such that no machine can be.
  std::size_t rendered = 0, timed = 0, refused = 0;
  std::size_t workers = 0;
  double seconds = 0;         // wall clock, from the first capture to the last result
  double render_seconds = 0;  // of all workers together: inside the machine
  bool stopped = false;       // by a signal; results so far are there

  void add(const SweepOutcome& more);
};

// Makes those of the points `mine` (of `points`, in ascending order) whose results are not there yet: several renders at
// once, each on its share of the threads, and from each the points that differ from it in timing keys only. Ctrl-C
// finishes the points in hand. Throws what reading a capture and writing a result throw, and LimitError when the
// images of one point exceed the limit; values that a machine cannot have become the point's fault, not the sweep's.
SweepOutcome run_sweep(const Study& study, const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                       const SweepFolder& folder, const SweepOptions& options, CaptureLibrary& library);

// Of those points, what a run would do: the groups of render_groups() without the points that are there.
struct WorkLeft {
  std::size_t found = 0;
  std::vector<std::vector<std::size_t>> groups;
};
WorkLeft work_left(const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                   const SweepFolder& folder, bool say_damaged);

}  // namespace tessera::replay
