#pragma once

#include <array>
#include <cstdint>

#include "base/counter.h"
#include "memory/dram_spec.h"

namespace tessera::memory {

// Counters of an external memory. An event is counted when its command is issued or its request is taken.
struct DramCounters {
  std::uint64_t reads = 0, writes = 0, forwarded_reads = 0, merged_writes = 0;
  std::uint64_t read_bursts = 0, write_bursts = 0, activates = 0, precharges = 0, refreshes = 0;
  std::uint64_t row_hits = 0, row_misses = 0, row_conflicts = 0;
  std::uint64_t bus_clocks = 0, read_latency_clocks = 0, turnarounds = 0;
  std::uint64_t active_rank_clocks = 0, rank_clocks = 0;

  bool operator==(const DramCounters&) const = default;
};

// Energy in nanojoules, by cause.
struct DramEnergy {
  double activate_nj = 0, transfer_nj = 0, io_nj = 0, refresh_nj = 0, background_nj = 0;
  double total_nj() const { return activate_nj + transfer_nj + io_nj + refresh_nj + background_nj; }
};

//   activate    = activates x activate_nj
//   transfer    = bits read x read_pj_bit + bits written x write_pj_bit
//   io          = bits x io_pj_bit
//   refresh     = refreshes x refresh_nj
//   background  = time of ranks with an open row x active_mw + the rest of their time x idle_mw
DramEnergy dram_energy(const DramSpec& spec, const DramCounters& counters);

}  // namespace tessera::memory

namespace tessera {

template <>
inline constexpr auto kCounterFields<memory::DramCounters> = std::to_array<CounterField<memory::DramCounters>>({
    {"dram.reads", &memory::DramCounters::reads, Combine::kSum, "transactions", "reads that were taken", ""},
    {"dram.writes", &memory::DramCounters::writes, Combine::kSum, "transactions", "writes that were taken", ""},
    {"dram.forwarded_reads", &memory::DramCounters::forwarded_reads, Combine::kSum, "transactions",
     "reads that a waiting write answered", ""},
    {"dram.merged_writes", &memory::DramCounters::merged_writes, Combine::kSum, "transactions",
     "writes that became one with a waiting write to the same address", ""},
    {"dram.read_bursts", &memory::DramCounters::read_bursts, Combine::kSum, "bursts", "read commands", ""},
    {"dram.write_bursts", &memory::DramCounters::write_bursts, Combine::kSum, "bursts", "write commands", ""},
    {"dram.activates", &memory::DramCounters::activates, Combine::kSum, "commands", "rows opened", ""},
    {"dram.precharges", &memory::DramCounters::precharges, Combine::kSum, "commands",
     "precharges; one of all banks counts once", ""},
    {"dram.refreshes", &memory::DramCounters::refreshes, Combine::kSum, "commands", "refreshes of a rank", ""},
    {"dram.row_hits", &memory::DramCounters::row_hits, Combine::kSum, "transactions",
     "transactions that found their row open", ""},
    {"dram.row_misses", &memory::DramCounters::row_misses, Combine::kSum, "transactions",
     "transactions that found their bank closed", ""},
    {"dram.row_conflicts", &memory::DramCounters::row_conflicts, Combine::kSum, "transactions",
     "transactions that found another row open", ""},
    {"dram.bus_clocks", &memory::DramCounters::bus_clocks, Combine::kSum, "clocks",
     "clocks in which a channel's data bus carried data", ""},
    {"dram.read_latency_clocks", &memory::DramCounters::read_latency_clocks, Combine::kSum, "clocks",
     "from taking a read to its last data, all reads", ""},
    {"dram.turnarounds", &memory::DramCounters::turnarounds, Combine::kSum, "events",
     "changes of a channel's data bus between reading and writing", ""},
    {"dram.active_rank_clocks", &memory::DramCounters::active_rank_clocks, Combine::kSum, "clocks",
     "clocks in which a rank of a channel had an open row", ""},
    {"dram.rank_clocks", &memory::DramCounters::rank_clocks, Combine::kSum, "clocks",
     "clocks of all ranks of all channels", ""},
});
TESSERA_COUNTERS_COVER(memory::DramCounters);

}  // namespace tessera
