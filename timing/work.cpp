#include "timing/work.h"

#include <algorithm>

namespace tessera::timing {
std::uint64_t FrameWork::dram_bytes() const {
  std::uint64_t bytes = other_bytes;
  for (const WorkRound& round : rounds) {
    bytes += round.geometry.dram_bytes;
    for (const TileWork& tile : round.tiles)
      for (const std::uint64_t phase : tile.dram_bytes) bytes += phase;
  }
  return bytes;
}

hardware::EnergyEvents energy_events(const FrameWork& work) {
  hardware::EnergyEvents events;
  for (const WorkRound& round : work.rounds) {
    events.counts += round.geometry.events;
    for (const TileWork& tile : round.tiles) events.counts += tile.events;
  }
  events.dram_bytes = work.dram_bytes();
  return events;
}

std::uint64_t compiled_clocks(const hardware::Machine& gpu, const TileItems& items) {
  std::uint64_t clocks = 0;
  for (const WarpItem& warp : items.warps) clocks += std::uint64_t{warp.lanes} * warp.clocks;
  if (gpu.shades_on_lanes())
    for (const SubPatchItem& item : items.sub_patches)
      clocks += std::uint64_t{item[Event::kVertices]} * item.domain_clocks;
  return clocks;
}

std::uint64_t compiled_clocks(const hardware::Machine& gpu, const FrameWork& work) {
  std::uint64_t clocks = 0;
  for (const WorkRound& round : work.rounds) {
    if (gpu.shades_on_lanes()) clocks += round.geometry.vertex_clocks;
    for (const TileItems& items : round.items) clocks += compiled_clocks(gpu, items);
  }
  return clocks;
}

void take_compiled(const hardware::Machine& gpu, std::uint64_t clocks, EventCounts& counts) {
  for (const Event event : {Event::kShaderInvocations, Event::kSurfaceEvaluations, Event::kBackgroundSamples,
                            Event::kVertexOutputs, Event::kLightTests, Event::kImageTexels})
    counts[event] = 0;
  if (gpu.shades_on_lanes()) counts[Event::kVertices] = 0;
  counts[Event::kShaderClocks] += clocks;
}

Phase phase_of(memory::Unit unit, memory::Purpose purpose, bool write) {
  if (unit == memory::Unit::kResolve || write) return Phase::kStore;
  return purpose == memory::Purpose::kTexture || purpose == memory::Purpose::kAttributes ? Phase::kShading
                                                                                         : Phase::kVisibility;
}

std::array<std::uint64_t, kPhaseCount> phase_bytes(const memory::Ledger& ledger) {
  std::array<std::uint64_t, kPhaseCount> bytes{};
  for (std::size_t u = 0; u < memory::kUnitCount; ++u)
    for (std::size_t p = 0; p < memory::kPurposeCount; ++p) {
      const auto unit = static_cast<memory::Unit>(u);
      const auto purpose = static_cast<memory::Purpose>(p);
      const memory::Traffic& traffic = ledger.traffic(unit, purpose);
      bytes[static_cast<std::size_t>(phase_of(unit, purpose, false))] += traffic.read_bytes;
      bytes[static_cast<std::size_t>(phase_of(unit, purpose, true))] += traffic.written_bytes;
    }
  return bytes;
}

namespace {

// Cycles of units; a unit takes as long as the longest of its parts, which work side by side.
class UnitTimes {
 public:
  void add(Stage unit, std::uint8_t parts, double cycles) {
    for (std::size_t part = 0; part < kParts; ++part)
      if ((parts >> part & 1) != 0) parts_[static_cast<std::size_t>(unit)][part] += cycles;
  }
  StageCycles cycles() const {
    StageCycles cycles{};
    for (std::size_t s = 0; s < kStageCount; ++s) cycles[s] = *std::max_element(parts_[s].begin(), parts_[s].end());
    return cycles;
  }

 private:
  static constexpr std::size_t kParts = 4;
  std::array<std::array<double, kParts>, kStageCount> parts_{};
};

}  // namespace

StageCycles stage_cycles(const hardware::Machine& gpu, const GeometryWork& work) {
  const EventCounts counts = placed(gpu, work.events);
  UnitTimes times;
  for (const Event event : hardware::kAllEvents) {
    const hardware::EventRow& row = hardware::kEventTable[event];
    if (row.phase == hardware::EventPhase::kGeometry)
      times.add(*row.unit, row.parts,
                gpu.clocks(event, counts[event]) / (row.in_each_core ? static_cast<double>(gpu.cores.count) : 1));
    else if (event == Event::kSamplingOperations)
      times.add(Stage::kFrontend, hardware::kFirstPart | hardware::kSecondPart, gpu.clocks(event, counts[event]));
  }
  StageCycles cycles = times.cycles();
  // Lanes, texture units, tessellators and decoders work on vertices side by side; lanes also run the other shaders before tiles.
  const bool compiled = gpu.shades_on_lanes() && gpu.shader.costs == hardware::ShaderCosts::kCompiled;
  const double shading = (compiled ? static_cast<double>(work.vertex_clocks) / gpu.per_clk(Event::kShaderClocks)
                                   : gpu.clocks(Event::kDomainInvocations, counts[Event::kDomainInvocations])) +
                         static_cast<double>(counts[Event::kShaderClocks]) / gpu.per_clk(Event::kShaderClocks);
  const double vertices = std::max({shading, compiled ? 0 : gpu.clocks(Event::kVertices, counts[Event::kVertices]),
                                    gpu.clocks(Event::kTexels, counts[Event::kTexels]),
                                    gpu.clocks(Event::kDecodedElements, counts[Event::kDecodedElements])});
  double& frontend = cycles[static_cast<std::size_t>(Stage::kFrontend)];
  frontend = std::max(frontend, vertices / static_cast<double>(gpu.cores.count));
  cycles[static_cast<std::size_t>(Stage::kDram)] = static_cast<double>(work.dram_bytes) / memory_rate(gpu);
  return cycles;
}

namespace {

constexpr bool timed_in_tiles(Event event) {
  const hardware::EventRow& row = hardware::kEventTable[event];
  return row.unit && row.phase != hardware::EventPhase::kGeometry && hardware::takes_time(event);
}

constexpr auto timed_events() {
  std::array<Event, static_cast<std::size_t>(
                        std::count_if(hardware::kAllEvents.begin(), hardware::kAllEvents.end(), timed_in_tiles))>
      events{};
  std::copy_if(hardware::kAllEvents.begin(), hardware::kAllEvents.end(), events.begin(), timed_in_tiles);
  return events;
}

}  // namespace

StageCycles stage_cycles(const hardware::Machine& gpu, const TileWork& work) {
  const EventCounts counts = placed(gpu, work.events);
  UnitTimes times;
  static constexpr auto kTimed = timed_events();
  for (const Event event : kTimed) {
    if (counts[event] == 0) continue;
    const hardware::EventRow& row = hardware::kEventTable[event];
    times.add(*row.unit, row.parts, gpu.clocks(event, counts[event]));
  }
  StageCycles cycles = times.cycles();
  cycles[static_cast<std::size_t>(Stage::kDram)] =
      static_cast<double>(work.dram_bytes[0] + work.dram_bytes[1] + work.dram_bytes[2]) / memory_rate(gpu);
  return cycles;
}

}  // namespace tessera::timing
