#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "memory/dram_banks.h"
#include "memory/dram_trace.h"

namespace tessera::memory {

// Options for playing a stream of bursts to an external memory in order: a refused request holds up all later ones.
struct DramReplayOptions {
  // true: requests come at their cycles, of a clock of `cycle_ns`; false: as fast as the memory takes them.
  bool timed = true;
  double cycle_ns = 1;
  // Bytes that a burst of the stream moves; each transaction of the memory that they touch is a request.
  std::uint32_t burst_bytes = 64;
};

// Results of a replay. The latency of a read counts from its time (timed), or from its being taken, to its last data.
struct DramReplayResult {
  DramClock end = 0;  // the last completion
  std::uint64_t transactions = 0, reads = 0;
  double mean_latency_ns = 0, p95_latency_ns = 0, max_latency_ns = 0;
  double max_lag_ns = 0;  // longest time from a request's cycle to its being taken
  DramCounters counters;
  DramEnergy energy;

  double end_ns(const DramSpec& spec) const { return static_cast<double>(end) * spec.tck_ns; }
  double gb_s(const DramSpec& spec) const;
  double row_hit_rate() const;
};

// Throws LimitError when a cycle lies beyond 2^52 clocks of the memory.
DramReplayResult replay_bursts(DramBanks& dram, const std::vector<Burst>& bursts, const DramReplayOptions& options);

}  // namespace tessera::memory
