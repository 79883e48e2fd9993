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
  std::size_t threads = 1;  // host threads in all
  std::size_t jobs = 1;     // most renders at once
  std::uint64_t max_bytes = std::uint64_t{4}
                            << 30;  // limit for a capture, for all images in memory, and for a record's frame
  bool strict = false;              // scene::CaptureLimits::strict
  bool quiet = false;
};

// Result of a run of a sweep. Host times, for people.
struct SweepOutcome {
  std::size_t mine = 0, found = 0, made = 0;  // wanted points; points found in the folder; points made now
  // Points made now, by kind: rendered, timed from a render's record, refused because no such machine is possible.
  std::size_t rendered = 0, timed = 0, refused = 0;
  std::size_t workers = 0;
  double seconds = 0;         // wall clock, from the first capture to the last result
  double render_seconds = 0;  // of all workers together: inside the machine
  bool stopped = false;       // by a signal; results so far are there

  void add(const SweepOutcome& more);
};

// Makes the points `mine` (of `points`, in ascending order) whose results are missing: several renders at once, each on
// its share of the threads, and from each the points that differ from it in timing keys only. Ctrl-C finishes the
// current points. Throws the errors of reading a capture and of writing a result, and LimitError when the images of one
// point exceed the limit; values that no machine can have become the point's fault and do not end the sweep.
SweepOutcome run_sweep(const Study& study, const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                       const SweepFolder& folder, const SweepOptions& options, CaptureLibrary& library);

// The work of a run on those points: the groups of render_groups() without the points that have results.
struct WorkLeft {
  std::size_t found = 0;
  std::vector<std::vector<std::size_t>> groups;
};
WorkLeft work_left(const std::vector<SweepPoint>& points, const std::vector<std::size_t>& mine,
                   const SweepFolder& folder, bool say_damaged);

}  // namespace tessera::replay
