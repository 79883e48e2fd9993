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

// Speeds, sizes and energies of the described machine: the input of the timing and the energy model. The values here
// and in hardware/events.def are the preset "mid-mobile". The front end and the binner exist once, the units of a
// tile core once in each core.

// Number of tile cores, fed by one tile scheduler, and the tile memory of each.
struct TileCores {
  std::int64_t count = 4;
  std::int64_t memory_bytes = 192 << 10;
};

// Source of a shader's operations and registers, for TimingModel::kEvents: the constants below, or the table of
// compiled code (hardware/shader_costs.h).
enum class ShaderCosts : std::uint8_t { kConstant, kCompiled };

// The unit that shades vertices: the tessellator, at a rate of its own, or the shader's lanes.
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
  // operations of a lane for one place or one light of a light list; [assumed], docs/passes.md derives them
  static constexpr double kLightOperations = 45;
  // operations of a lane for one texel of a pass over an image; [assumed], the mean of a bloom's steps
  static constexpr double kImageOperations = 40;
};

// Texture caches of the cores, and the L2 that they share; l2_bytes 0 means that there is no L2.
struct Caches {
  static constexpr std::int64_t kLineBytes = 64;   // [assumed] at least a burst: a block of 4x4 texels
  static constexpr std::int64_t kTextureWays = 4;  // [assumed] ways of the texture caches

  std::int64_t texture_bytes = 16 << 10;
  std::int64_t l2_bytes = 256 << 10;
  std::int64_t l2_ways = 8;
};

// Timing model of the external memory for TimingModel::kEvents: bytes at a rate, or channels, banks and rows of a type.
enum class MemoryModel : std::uint8_t { kFluid, kBanks };
enum class MemoryType : std::uint8_t { kLpddr4x4266, kLpddr5_6400, kLpddr5x8533, kLpddr4_3200 };

// The external memory.
struct MemoryInterface {
  MemoryModel model = MemoryModel::kBanks;
  MemoryType type = MemoryType::kLpddr4x4266;
  std::int64_t channels = 4;  // number of channels of 16 bits
  std::int64_t burst_bytes = 64;
  double gb_per_s = 34.085;
  double gpu_share = 0.7;
  double latency_ns = 192 / 0.85;
  double pj_per_bit = 12.5;
};

// Granularity of timing: phases of tiles as whole pipelines (docs/timing_model.md), or every item of every unit as an event.
enum class TimingModel : std::uint8_t { kPhases, kEvents };

// Content of the caches when a frame begins, for TimingModel::kEvents: empty, or as the previous frame left it.
enum class FrameCaches : std::uint8_t { kEmpty, kWarm };

// Work that overlaps a frame's tiles: none; geometry and tiles of further passes that do not need these tiles; and
// also the geometry of the next frame.
enum class FrameOverlap : std::uint8_t { kNone, kPasses, kFrames };

// Queues, latencies and limits of work in progress, for TimingModel::kEvents.
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

// Frame rate for power; a machine that is ahead waits, and leaks unless its supply is cut.
enum class PowerGating : std::uint8_t { kNone, kBetweenFrames };
struct FrameRate {
  double target_fps = 60;  // 0: as many frames as the machine can render
  PowerGating gating = PowerGating::kNone;
};

// Silicon beside the events' rates (fixed area of a core, area of a KiB), and the leakage of each mm2 (hardware/area.h).
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

// The described machine. The external memory has its own clock and supply, so the GPU's clock changes neither.
struct Machine {
  double clock_mhz = 850;
  double nominal_mhz = 850;  // clock at which the energies hold (hardware/voltage.h)
  TileCores cores;
  EventArray<double> rates = default_rates();            // of one instance of the unit, per clock: keys of kEventTable
  EnergyPerEvent energy_pj = default_energies();         // keys of kEventTable
  SiliconArray<double> silicon_mm2 = default_silicon();  // keys of kSiliconTable
  OtherSilicon silicon;
  PixelShader shader;
  Caches caches;
  MemoryInterface memory;
  QueueSizes queues;
  FrameRate rate;

  // Whether the configuration uses a model: events, banks, compiled shaders.
  bool times_events() const { return queues.model == TimingModel::kEvents; }
  bool has_banks() const { return times_events() && memory.model == MemoryModel::kBanks; }
  bool has_compiled_shaders() const { return times_events() && shader.costs == ShaderCosts::kCompiled; }

  // The settings that choose a coarser timing model than the default, such as {"machine.timing=phases"}; reports of
  // such a machine name them.
  std::vector<std::string> coarser_models() const;

  // Peak rate of the external memory: the sum of its channels with has_banks(), else memory.gb_per_s.
  // memory_bytes_per_clk() is the GPU's share of it per clock.
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
  // Throughput and energy of an event. They come from kEventTable; an event with timed_as or priced_as counts as
  // operations() times the event that it names.
  double operations(Event event) const;
  double per_clk(Event event) const;
  double clocks(Event event, std::uint64_t count) const {
    return takes_time(event) ? static_cast<double>(count) * operations(event) / per_clk(event) : 0;
  }
  double pj(Event event) const;

  // Bytes of a line of the texture caches and the L2: at least a burst.
  std::int64_t line_bytes() const { return std::max(Caches::kLineBytes, memory.burst_bytes); }
};

// The counts as the machine charges them: with tessellator.domain_shading=lanes, vertices become shader invocations
// and their heights become texture lookups.
EventCounts placed(const Machine& gpu, EventCounts counts);

Keys<Machine> burst_keys();    // memory.burst_bytes, which units read as well
Keys<Machine> machine_keys();  // all other keys of the machine

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
