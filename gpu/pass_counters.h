#pragma once

#include <string>
#include <string_view>

#include "binner/binner.h"
#include "frontend/front_end.h"
#include "gpu/tile_scheduler.h"
#include "tilecore/tessellation/tessellation_cache.h"

namespace tessera::gpu {

// Takes together what the units of a view count, pass by pass.
//
// Invariants (cited by the tests):
//   PA1  Counters and ledgers of a view's passes add up to those of the view; of counters that are peaks, a pass has the
//        one up to its end.
class PassCounters {
 public:
  // All must outlive it. What `run.result` has counted before belongs to the first pass.
  PassCounters(const ViewRun& run, const frontend::FrontEndResult& front_end, const binner::Binner& binner,
               const tilecore::TessellationCache& cache)
      : run_(run), front_end_(front_end), binner_(binner), cache_(cache) {}

  // What was counted since the last call is a pass's: goes to the result's passes.
  void end(std::string_view pass);
  // No pass follows: the result's counters become those of the view.
  void finish() { run_.result.counters = seen_; }

 private:
  FrameCounters all();

  const ViewRun& run_;
  const frontend::FrontEndResult& front_end_;
  const binner::Binner& binner_;
  const tilecore::TessellationCache& cache_;
  WorkRecorder::Sums sums_;  // taken so far
  FrameCounters seen_;
};

}  // namespace tessera::gpu
