#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/key_table.h"
#include "hardware/events.h"

namespace tessera::hardware {

// Speeds, sizes and energies of the described machine: what the timing and the energy model read. Values, here and in
// hardware/events.def, are those of the preset "mid-mobile". The front end and the binner exist once, the units of a tile core once in each core.

// How many there are, fed by one tile scheduler, and the tile memory of each.
struct TileCores {
  std::int64_t count = 4;
  std::int64_t memory_bytes = 192 << 10;
};

// Where the operations and registers of a shader come from, for TimingModel::kEvents: the constants below, or the table of
// compiled code (hardware/shader_costs.h).
enum class ShaderCosts : std::uint8_t { kConstant, kCompiled };

// Where vertices are shaded: in the tessellator, at a rate of its own, or on the shader's lanes.
enum class DomainShading : std::uint8_t { kUnit, kLanes };

// The shader lanes of a core.
struct PixelShader {
  ShaderCosts costs = ShaderCosts::kCompiled;
  DomainShading domain = DomainShading::kLanes;
  std::int64_t lanes = 32;
  std::int64_t warp_lanes = 32;
  double operations = 160;
  double surface_operations = 130;
  double background_operations = 46;
  // A lane does so many operations for a place or a light of a light list. [assumed] docs/passes.md derives them
  static constexpr double kLightOperations = 45;
  // A lane does so many for a texel of a pass over an image. [assumed] The mean of a bloom's steps
  static constexpr double kImageOperations = 40;
};

// Texture caches of the cores, and the L2 that they share; l2_bytes 0: none.
struct Caches {
  static constexpr std::int64_t kLineBytes = 64;   // at least a burst [assumed]: a block of 4x4 texels
  static constexpr std::int64_t kTextureWays = 4;  // of the texture caches [assumed]

  std::int64_t texture_bytes = 16 << 10;
  std::int64_t l2_bytes = 256 << 10;
  std::int64_t l2_ways = 8;
};

// How the external memory is timed with TimingModel::kEvents: bytes at a rate; or channels, banks and rows of a type.
enum class MemoryModel : std::uint8_t { kFluid, kBanks };
enum class MemoryType : std::uint8_t { kLpddr4x4266, kLpddr5_6400, kLpddr5x8533, kLpddr4_3200 };

// The external memory.
struct MemoryInterface {
  MemoryModel model = MemoryModel::kBanks;
  MemoryType type = MemoryType::kLpddr4x4266;
  std::int64_t channels = 4;  // of 16 bits
  std::int64_t burst_bytes = 64;
  double gb_per_s = 34.085;
  double gpu_share = 0.7;
  double latency_ns = 192 / 0.85;
  double pj_per_bit = 12.5;
};

// How work is timed: phases of tiles as whole pipelines (docs/timing_model.md), or every item of every unit as an event.
enum class TimingModel : std::uint8_t { kPhases, kEvents };

// What the caches hold when a frame begins, for TimingModel::kEvents: nothing, or what the frame before left.
enum class FrameCaches : std::uint8_t { kEmpty, kWarm };

// Units work beside a frame's tiles on: nothing; geometry and tiles of further passes that do not need these tiles; and
// geometry of the next frame.
enum class FrameOverlap : std::uint8_t { kNone, kPasses, kFrames };

// Queues, latencies and bounds of what is under way, for TimingModel::kEvents.
struct QueueSizes {
  TimingModel model = TimingModel::kEvents;
  FrameOverlap overlap = FrameOverlap::kNone;
  FrameCaches caches = FrameCaches::kEmpty;
  std::int64_t items = 4;
  std::int64_t fetched_lines = 32;
  std::int64_t table_lines = 32;
  std::int64_t store_bytes = 4096;
  std::int64_t texture_requests = 32;
  double texture_latency_clk = 24;
  std::int64_t l2_banks = 4;
  double l2_lines_per_clk = 1;
  double l2_latency_clk = 40;
  std::int64_t l2_requests = 128;
  std::int64_t max_warps = 16;
  std::int64_t register_bytes = 128 << 10;
  std::int64_t registers = 64;
};

// How often frames are drawn, for power; a machine that is ahead waits, and leaks unless its supply is cut.
enum class PowerGating : std::uint8_t { kNone, kBetweenFrames };
struct FrameRate {
  double target_fps = 60;  // 0: as many as it can
  PowerGating gating = PowerGating::kNone;
};

// Silicon that no event takes: of a core whatever its rates, of a KiB; and what a mm2 of any leaks (hardware/area.h).
struct OtherSilicon {
  double core_mm2 = 0.15;
  double sram_mm2_per_kib = 0.0005;
  double register_mm2_per_kib = 0.001;
  double leakage_mw_per_mm2 = 10;
};

using EnergyPerEvent = EventArray<double>;

constexpr EventArray<double> default_rates() {
  EventArray<double> rates{};
  for (std::size_t e = 0; e < kEventCount; ++e) rates[e] = kEventTable[e].rate.per_clk;
  return rates;
}
constexpr EnergyPerEvent default_energies() {
  EnergyPerEvent energies{};
  for (std::size_t e = 0; e < kEventCount; ++e) energies[e] = kEventTable[e].energy.pj;
  return energies;
}
constexpr SiliconArray<double> default_silicon() {
  SiliconArray<double> silicon{};
  for (std::size_t s = 0; s < kSiliconCount; ++s) silicon[s] = kSiliconTable[s].mm2;
  return silicon;
}

// The memory has its own clock and its own supply: another clock of the GPU leaves both alone.
struct Machine {
  double clock_mhz = 850;
  double nominal_mhz = 850;  // at which the energies hold (hardware/voltage.h)
  TileCores cores;
  EventArray<double> rates = default_rates();            // of one instance of the unit, in a clock: keys of kEventTable
  EnergyPerEvent energy_pj = default_energies();         // likewise
  SiliconArray<double> silicon_mm2 = default_silicon();  // keys of kSiliconTable
  OtherSilicon silicon;
  PixelShader shader;
  Caches caches;
  MemoryInterface memory;
  QueueSizes queues;
  FrameRate rate;

  // Which of the models that the configuration chooses are in use.
  bool times_events() const { return queues.model == TimingModel::kEvents; }
  bool has_banks() const { return times_events() && memory.model == MemoryModel::kBanks; }
  bool has_compiled_shaders() const { return times_events() && shader.costs == ShaderCosts::kCompiled; }

  // The settings that choose a coarser model of time than the default one does, as in {"machine.timing=phases"}: figures of
  // such a machine name them.
  std::vector<std::string> coarser_models() const;

  // Peak rate of the external memory: of its channels with has_banks(), else memory.gb_per_s; and what the GPU gets of it
  // in a clock.
  double peak_gb_per_s() const;
  double memory_bytes_per_clk() const {
    return peak_gb_per_s() * 1e3 / clock_mhz * (has_banks() ? 1 : memory.gpu_share);
  }
  // memory.gb_per_s and memory.latency_ns in clocks of the GPU.
  double bytes_per_clk() const { return memory.gb_per_s * 1e3 / clock_mhz; }
  double latency_clk() const { return memory.latency_ns * clock_mhz * 1e-3; }
  void set_bytes_per_clk(double bytes) { memory.gb_per_s = bytes * clock_mhz * 1e-3; }
  void set_latency_clk(double clk) { memory.latency_ns = clk * 1e3 / clock_mhz; }

  bool shades_on_lanes() const { return shader.domain == DomainShading::kLanes; }
  // How many of an event its unit does in a clock, and what one costs: as the table says, but that some events are so many
  // operations of another.
  double operations(Event event) const;
  double per_clk(Event event) const;
  double clocks(Event event, std::uint64_t count) const {
    return takes_time(event) ? static_cast<double>(count) * operations(event) / per_clk(event) : 0;
  }
  double pj(Event event) const;

  // A line of the texture caches and the L2: at least a burst.
  std::int64_t line_bytes() const { return std::max(Caches::kLineBytes, memory.burst_bytes); }
};

// The counts of events as the machine charges them: with tessellator.domain_shading=lanes, vertices are invocations of the
// shader and their heights its texels.
EventCounts placed(const Machine& gpu, EventCounts counts);

Keys<Machine> burst_keys();    // memory.burst_bytes, which units read, too
Keys<Machine> machine_keys();  // the others

}  // namespace tessera::hardware

namespace tessera {

template <>
inline constexpr auto kEnumWords<hardware::ShaderCosts> = std::to_array<std::string_view>({"constant", "compiled"});
template <>
inline constexpr auto kEnumWords<hardware::DomainShading> = std::to_array<std::string_view>({"unit", "lanes"});
template <>
inline constexpr auto kEnumWords<hardware::MemoryModel> = std::to_array<std::string_view>({"fluid", "banks"});
template <>
inline constexpr auto kEnumWords<hardware::MemoryType> =
    std::to_array<std::string_view>({"lpddr4x-4266", "lpddr5-6400", "lpddr5x-8533", "lpddr4-3200"});
template <>
inline constexpr auto kEnumWords<hardware::FrameCaches> = std::to_array<std::string_view>({"empty", "warm"});
template <>
inline constexpr auto kEnumWords<hardware::FrameOverlap> = std::to_array<std::string_view>({"none", "passes",
                                                                                            "frames"});
template <>
inline constexpr auto kEnumWords<hardware::PowerGating> = std::to_array<std::string_view>({"none", "between_frames"});
template <>
inline constexpr auto kEnumWords<hardware::TimingModel> = std::to_array<std::string_view>({"phases", "events"});

}  // namespace tessera
