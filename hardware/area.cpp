#include "hardware/area.h"

#include <algorithm>
#include <utility>

namespace tessera::hardware {

double Area::total_mm2() const {
  double sum = 0;
  for (const auto& [unit, mm2] : by_unit_mm2) sum += mm2;
  return sum;
}

namespace {

// True for events of a unit that the machine lacks: hashing units without elimination, decoders without encoded
// records, and the tessellator when lanes shade its vertices.
bool lacks(const Machine& gpu, const OtherParts& others, Event event) {
  return (event == Event::kHashedInputs && !others.hashes_inputs) ||
         (event == Event::kHashedColors && !others.hashes_colors) ||
         (kEventTable[event].silicon == Silicon::kDecoder && !others.decodes_geometry) ||
         (event == Event::kVertices && gpu.shades_on_lanes());
}

}  // namespace

Area machine_area(const Machine& gpu, const OtherParts& others) {
  const auto cores = static_cast<double>(gpu.cores.count);
  const auto kib = [](std::int64_t bytes) { return static_cast<double>(bytes) / 1024; };

  Area area;
  std::map<std::string, double>& unit = area.by_unit_mm2;
  std::map<std::string, double> core = {{"fixed_units", gpu.silicon.core_mm2}};  // area of one core
  for (std::size_t s = 0; s < kSiliconCount; ++s) {
    const SiliconRow& row = kSiliconTable[s];
    std::map<std::pair<bool, std::string>, double> rates;  // by whether the unit exists once, and its name
    for (const Event event : kAllEvents) {
      if (kEventTable[event].silicon != static_cast<Silicon>(s) || lacks(gpu, others, event)) continue;
      const bool once = kEventTable[event].phase == EventPhase::kGeometry;
      const std::string group(!row.group.empty() ? row.group : once ? unit_name(event) : "fixed_units");
      double& rate = rates[{once, group}];
      const double more = gpu.per_clk(event) * kEventTable[event].share;
      rate = row.combine == Combine::kMax ? std::max(rate, more) : rate + more;
    }
    for (const auto& [of, rate] : rates) (of.first ? unit : core)[of.second] += gpu.silicon_mm2[s] * rate;
  }
  for (const auto& [group, mm2] : core) unit[group] = cores * mm2;
  unit["registers"] = cores * gpu.silicon.register_mm2_per_kib * kib(gpu.queues.register_bytes);
  unit["tile_memory"] = cores * gpu.silicon.sram_mm2_per_kib * kib(gpu.cores.memory_bytes);
  unit["texture_cache"] = cores * gpu.silicon.sram_mm2_per_kib * kib(gpu.caches.texture_bytes);
  unit["l2"] = gpu.silicon.sram_mm2_per_kib * kib(gpu.caches.l2_bytes);
  unit["other_memories"] = gpu.silicon.sram_mm2_per_kib * (kib(others.shared_bytes) + cores * kib(others.core_bytes));
  return area;
}

}  // namespace tessera::hardware
