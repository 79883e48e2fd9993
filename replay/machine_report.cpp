#include "replay/machine_report.h"

#include <cmath>

#include <fmt/format.h>

#include "gpu/counter_list.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

std::uint64_t whole(double cycles) { return static_cast<std::uint64_t>(std::ceil(cycles)); }

json unit_json(double busy, double cycles) {
  return {{"busy_cycles", whole(busy)}, {"utilisation", cycles > 0 ? busy / cycles : 0.0}};
}

// Sorted by name, as members of JSON objects are.
std::vector<std::string> unit_names() {
  const json units = timing_json({})["units"];
  std::vector<std::string> names;
  for (const auto& [unit, value] : units.items()) names.push_back(unit);
  return names;
}

std::vector<std::string> energy_names() {
  std::vector<std::string> names;
  for (const auto& [unit, nj] : hardware::frame_energy({}, {}, 0, 0).by_unit_nj) names.push_back(unit);
  return names;
}

}  // namespace

json timing_json(const timing::FrameTiming& timing) {
  json units = json::object();
  for (const auto& [unit, busy] : gpu::busy_cycles(timing)) units[std::string(unit)] = unit_json(busy, timing.cycles);
  json out = {{"cycles", whole(timing.cycles)},
              {"latency_cycles", whole(timing.latency)},
              {"bound_by", timing.bound_by ? std::string(name(*timing.bound_by)) : ""},
              {"bound_by_cycles", whole(timing.bound_cycles)},
              {"tiles_in_flight", timing.cores_busy > 0 ? timing.tiles_busy / timing.cores_busy : 0.0},
              {"tile_memory_waits", whole(timing.memory_waits)},
              {"units", units}};
  for (const timing::PassTime& pass : timing.passes)
    out["passes"].push_back(
        {{"name", pass.name}, {"begin_cycles", whole(pass.begin)}, {"end_cycles", whole(pass.end)}});
  if (!timing.events) return out;
  out["coarse_cycles"] = whole(timing.coarse_cycles);
  const timing::SimulationCounts& events = *timing.events;
  json stalls = json::object();
  for (std::size_t s = 0; s < timing::kStallCount; ++s)
    stalls[std::string(name(static_cast<timing::Stall>(s)))] = whole(events.stalls[s]);
  json path = json::object();
  for (std::size_t p = 0; p < timing::kPathParts; ++p)
    path[std::string(name(static_cast<timing::Bound>(p)))] = whole(events.path.clk[p]);
  out["events"] = {{"critical_path", path},
                   {"texture_requests", events.texture_requests},
                   {"texture_misses", events.texture_misses},
                   {"l2_requests", events.memory.l2_requests},
                   {"l2_misses", events.memory.l2_misses},
                   {"dram_read_bytes", events.memory.read_bytes},
                   {"dram_written_bytes", events.memory.written_bytes},
                   {"dram_activates", events.memory.activates},
                   {"dram_row_hits", events.memory.row_hits},
                   {"shader_stalls", stalls},
                   {"simulated", events.events}};
  if (const timing::DomainCounts& domain = events.domain; domain.vertices > 0)
    out["events"]["domain"] = {{"vertices", domain.vertices},
                               {"warps", domain.warps},
                               {"lookups", domain.texels},
                               {"lane_cycles", whole(domain.lanes_busy)}};
  return out;
}

json energy_json(const hardware::FrameEnergy& energy) {
  return {{"total_nj", energy.total_nj()}, {"by_unit", energy.by_unit_nj}};
}

json area_json(const hardware::Area& area) { return {{"total_mm2", area.total_mm2()}, {"by_unit", area.by_unit_mm2}}; }

void put_model(const hardware::Machine& gpu, const timing::FrameTiming& timing, const hardware::FrameEnergy& energy,
               double frames, json& into) {
  into["timing"] = timing_json(timing);
  into["energy"] = energy_json(energy);
  const double ms = timing.cycles / gpu.clock_mhz * 1e-3;
  into["timing"]["coarser_models"] = gpu.coarser_models();
  into["timing"]["peak_gb_per_s"] = gpu.memory_bytes_per_clk() * gpu.clock_mhz * 1e-3;
  into["timing"]["time_ms"] = ms;
  into["timing"]["frames_per_second"] = ms > 0 ? 1e3 * frames / ms : 0.0;
  into["energy"]["power_w"] = hardware::power_w(gpu, energy, timing.cycles, frames);
}

std::string coarser_models_note(const json& timing) {
  const auto models = timing.value("coarser_models", std::vector<std::string>());
  return models.empty() ? ""
                        : fmt::format("timed by {}, {} than the default", fmt::join(models, " and "),
                                      models.size() == 1 ? "a coarser model" : "coarser models");
}

std::string model_csv_header() {
  std::string text =
      ",timing.cycles,timing.time_ms,timing.frames_per_second,timing.latency_cycles,timing.bound_by,timing.bound_by_"
      "cycles";
  for (const std::string& unit : unit_names())
    text += fmt::format(",timing.{0}.busy_cycles,timing.{0}.utilisation", unit);
  text += ",energy.total_nj,energy.power_w";
  for (const std::string& unit : energy_names()) text += fmt::format(",energy.{}_nj", unit);
  return text + ",area.total_mm2";
}

std::string model_csv(const json& frame) {
  const json &timing = frame["timing"], &energy = frame["energy"];
  std::string text =
      fmt::format(",{},{:.6f},{:.3f},{},{},{}", timing["cycles"].get<std::uint64_t>(), timing["time_ms"].get<double>(),
                  timing["frames_per_second"].get<double>(), timing["latency_cycles"].get<std::uint64_t>(),
                  timing["bound_by"].get<std::string>(), timing["bound_by_cycles"].get<std::uint64_t>());
  for (const std::string& unit : unit_names())
    text += fmt::format(",{},{:.6f}", timing["units"][unit]["busy_cycles"].get<std::uint64_t>(),
                        timing["units"][unit]["utilisation"].get<double>());
  text += fmt::format(",{:.3f},{:.6f}", energy["total_nj"].get<double>(), energy["power_w"].get<double>());
  for (const std::string& unit : energy_names()) text += fmt::format(",{:.3f}", energy["by_unit"][unit].get<double>());
  return text + fmt::format(",{:.6f}", frame["area"]["total_mm2"].get<double>());
}

}  // namespace tessera::replay
