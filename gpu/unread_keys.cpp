#include "gpu/unread_keys.h"

#include <algorithm>
#include <array>
#include <span>

#include <fmt/format.h>

namespace tessera::gpu {
namespace {

bool events(const GpuConfiguration& gpu) { return gpu.queues.model == hardware::TimingModel::kEvents; }
bool phases(const GpuConfiguration& gpu) { return !events(gpu); }
bool banks(const GpuConfiguration& gpu) { return gpu.has_banks(); }
bool fluid(const GpuConfiguration& gpu) { return events(gpu) && !banks(gpu); }
bool compiled(const GpuConfiguration& gpu) { return gpu.has_compiled_shaders(); }
bool on_lanes(const GpuConfiguration& gpu) { return gpu.shades_on_lanes(); }
bool raw_geometry(const GpuConfiguration& gpu) { return gpu.geometry.raw(); }
bool fitted(const GpuConfiguration& gpu) { return gpu.tile.fit; }

struct Rule {
  std::string_view key;
  bool (*unread)(const GpuConfiguration&);
  std::string_view because;
};

constexpr std::string_view
    kOfPhases = "machine.timing=phases does not read it: set machine.timing=events",
    kOfBanks =
        "memory.model=banks does not read it: set memory.type and memory.channels, or "
        "memory.model=fluid",
    kOfFluid = "memory.model=fluid does not read it: set memory.gb_per_s, or memory.model=banks",
    kOfCompiled = "shader.costs=compiled does not read it: set shader.costs=constant",
    kOfLanes =
        "tessellator.domain_shading=lanes does not read it: set "
        "energy.shader_operation_pj, or tessellator.domain_shading=unit",
    kOfFit = "tile.fit=true does not read it: tilecore.memory_bytes says how large tiles are",
    kOfEncoding = "geometry.encoding=raw does not read it: set geometry.encoding=quantised, meshlet or dgf";

constexpr auto kRules = std::to_array<Rule>({
    {"memory.gb_per_s", banks, kOfBanks},
    {"memory.bytes_per_clk", banks, kOfBanks},
    {"memory.latency_ns", banks, kOfBanks},
    {"memory.latency_clk", banks, kOfBanks},
    {"memory.gpu_share", banks, kOfBanks},
    {"memory.type", fluid, kOfFluid},
    {"memory.channels", fluid, kOfFluid},
    {"memory.model", phases, kOfPhases},
    {"memory.type", phases, kOfPhases},
    {"memory.channels", phases, kOfPhases},
    {"shader.costs", phases, kOfPhases},
    {"machine.caches", phases, kOfPhases},
    {"tilecore.queue_items", phases, kOfPhases},
    {"tilecore.fetched_lines", phases, kOfPhases},
    {"frontend.fetched_lines", phases, kOfPhases},
    {"resolve.store_bytes", phases, kOfPhases},
    {"texture.requests", phases, kOfPhases},
    {"texture.latency_clk", phases, kOfPhases},
    {"l2.banks", phases, kOfPhases},
    {"l2.lines_per_clk", phases, kOfPhases},
    {"l2.latency_clk", phases, kOfPhases},
    {"l2.requests", phases, kOfPhases},
    {"shader.max_warps", phases, kOfPhases},
    {"shader.registers", phases, kOfPhases},
    {"shader.operations", compiled, kOfCompiled},
    {"shader.surface_operations", compiled, kOfCompiled},
    {"shader.background_operations", compiled, kOfCompiled},
    {"shader.registers", compiled, kOfCompiled},
    {"energy.vertex_pj", on_lanes, kOfLanes},
    {"geometry.bits", raw_geometry, kOfEncoding},
    {"tile.width", fitted, kOfFit},
    {"tile.height", fitted, kOfFit},
});

}  // namespace

std::string_view unread_because(const GpuConfiguration& gpu, std::string_view key) {
  for (const Rule& rule : kRules)
    if (rule.key == key && rule.unread(gpu)) return rule.because;
  return {};
}

std::vector<std::string> configuration_notes(const GpuConfiguration& gpu) {
  std::vector<std::string> notes = gpu.key_notes;
  for (const std::string& key : gpu.file_keys)
    if (const std::string_view because = unread_because(gpu, key); !because.empty())
      notes.push_back(fmt::format("{}: {}", key, because));
  return notes;
}

}  // namespace tessera::gpu
