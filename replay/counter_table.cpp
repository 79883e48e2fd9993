#include <algorithm>
#include <vector>

#include "baselines/baseline_counters.h"
#include "gpu/counter_list.h"
#include "replay/statistics.h"

namespace tessera::replay {

nlohmann::json describe_counters() {
  std::vector<gpu::CounterInfo> infos = gpu::counter_infos();
  gpu::append_counter_infos<baselines::BaselineCounters>(infos);
  std::sort(infos.begin(), infos.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  nlohmann::json rows = nlohmann::json::array();
  for (const gpu::CounterInfo& info : infos)
    rows.push_back({{"name", info.name},
                    {"unit", info.unit},
                    {"over_frames", info.over_frames == Combine::kSum ? "sum" : "peak"},
                    {"meaning", info.meaning},
                    {"vendor", info.vendor}});
  return rows;
}

}  // namespace tessera::replay
