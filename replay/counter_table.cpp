#include <algorithm>

#include "replay/statistics.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

template <class S>
json describe_fields() {
  json rows = json::array();
  for (const auto& field : kCounterFields<S>)
    rows.push_back({{"name", field.name},
                    {"unit", field.unit},
                    {"over_frames", field.combine == Combine::kSum ? "sum" : "peak"},
                    {"meaning", field.meaning},
                    {"vendor", field.vendor}});
  return rows;
}

}  // namespace

json describe_counters() {
  json rows = json::array();
  const gpu::FrameCounters counters;
  for_each_counter_struct(counters, counters, [&](const auto& unit, const auto&) {
    for (json& row : describe_fields<std::decay_t<decltype(unit)>>()) rows.push_back(std::move(row));
  });
  for (json& row : describe_fields<baselines::BaselineCounters>()) rows.push_back(std::move(row));
  rows.push_back({{"name", "dram.read_bytes"},
                  {"unit", "bytes"},
                  {"over_frames", "sum"},
                  {"meaning", "Bytes read over the external memory interface, in whole bursts: the sum of the ledger."},
                  {"vendor", "MaliExtBusRdBy; V3D AXI-read-bytes-seen; Adreno Read Total; Apple GPU read bandwidth"}});
  rows.push_back(
      {{"name", "dram.written_bytes"},
       {"unit", "bytes"},
       {"over_frames", "sum"},
       {"meaning", "Bytes written over the external memory interface, in whole bursts: the sum of the ledger."},
       {"vendor", "MaliExtBusWrBy; V3D AXI-write-bytes-seen; Adreno Write Total; Apple GPU write bandwidth"}});
  std::sort(rows.begin(), rows.end(), [](const json& a, const json& b) { return a["name"] < b["name"]; });
  return rows;
}

}  // namespace tessera::replay
