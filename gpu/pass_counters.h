#pragma once

#include <string>
#include <string_view>

#include "binner/binner.h"
#include "frontend/front_end.h"
#include "gpu/tile_scheduler.h"
#include "tilecore/tessellation/tessellation_cache.h"

namespace tessera::gpu {

// Collects the counters of all units of a view, pass by pass.
//
// Invariants (cited by the tests):
//   PA1  The counters and ledgers of a view are the sums over its passes. A pass reports a peak counter as it was when the
//        pass ended.
class PassCounters {
 public:
  // All must outlive it. Counters that `run.result` already has belong to the first pass.
  PassCounters(const ViewRun& run, const frontend::FrontEndResult& front_end, const binner::Binner& binner,
               const tilecore::TessellationCache& cache)
      : run_(run), front_end_(front_end), binner_(binner), cache_(cache) {}

  // Adds a pass to the result, with the counters of all units since the last call.
  void end(std::string_view pass);
  // Gives the result the counters of the whole view. Call it after the last pass.
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
