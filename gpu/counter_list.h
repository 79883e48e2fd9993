#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "base/counter.h"
#include "gpu/frame_counters.h"
#include "timing/timing_model.h"

namespace tessera::gpu {

// Description of a counter, independent of the unit that counts it.
struct CounterInfo {
  std::string_view name;  // "unit.event"
  std::string_view unit;
  Combine over_frames;
  std::string_view meaning;
  std::string_view vendor;  // "" if no vendor offers it
};

// The declared counters of S.
template <class S>
void append_counter_infos(std::vector<CounterInfo>& infos) {
  for (const auto& field : kCounterFields<S>)
    infos.push_back({field.name, field.unit, field.combine, field.meaning, field.vendor});
}

// Every counter that a frame can have, with the ledger's sums; in no fixed order.
std::vector<CounterInfo> counter_infos();

// A counter name of earlier versions, which scripts may still ask for.
struct FormerCounter {
  std::string_view name;
  std::string_view now;  // the name of the counter now, or the formula for it from others; "": no counter replaces it
};
// In the order of their names.
std::span<const FormerCounter> former_counters();

// The values of all counters by name, with the ledger's sums dram.read_bytes and dram.written_bytes. A counter whose
// unit did not run is absent, not zero.
std::map<std::string_view, std::uint64_t> counter_values(const FrameCounters& counters);

// The pairs of a ledger that moved a byte, by unit, then purpose.
struct TrafficRow {
  memory::Unit unit;
  memory::Purpose purpose;
  memory::Traffic traffic;
};
std::vector<TrafficRow> traffic_rows(const memory::Ledger& ledger);

// Busy cycles of every unit, by its name, and of "tilecores": the time in which a core had a tile in progress.
std::map<std::string_view, double> busy_cycles(const timing::FrameTiming& timing);

}  // namespace tessera::gpu
