#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "base/key_table.h"

namespace tessera::hardware {

// Speeds, sizes and energies of the described machine: what the timing and the energy model read. Values are those of
// the preset "mid-mobile". The front end and the binner exist once, the units of a tile core once in each core.

// How many there are, fed by one tile scheduler, and the tile memory of each.
struct TileCores {
  std::int64_t count = 4;
  std::int64_t memory_bytes = 192 << 10;
};

// What one instance of each unit does in a clock.
struct Throughputs {
  double bounds_per_clk = 0.25;
  double binned_entries_per_clk = 1;
  double binned_tiles_per_clk = 4;
  double fetched_entries_per_clk = 0.5;
  double sort_steps_per_clk = 4;
  double vertices_per_clk = 1;
  double transforms_per_clk = 3;
  double boxes_per_clk = 1;
  double box_tests_per_clk = 16;
  double stencil_tests_per_clk = 32;
  double sampling_operations_per_clk = 32;
  double triangle_tests_per_clk = 16;
  double alpha_tests_per_clk = 4;
  double depth_blocks_per_clk = 1;
  double compacted_samples_per_clk = 32;
  double texels_per_clk = 2;
  double blends_per_clk = 4;
  double resolved_pixels_per_clk = 4;
  double resolve_operations_per_clk = 16;
};

// What the front end does with the previous frame's depths: speeds and energies.
struct ReprojectionUnit {
  double reprojected_blocks_per_clk = 1;
  double depth_tests_per_clk = 4;
  double reprojected_block_pj = 60;
  double depth_test_pj = 1;
};

// Units that hash what tiles are rendered from, beside the binner, and their colours, in each core: of rendering and
// transaction elimination.
struct SignatureUnits {
  double input_bytes_per_clk = 32;
  double color_bytes_per_clk = 32;
  double byte_pj = 0.4;
  double byte_mm2 = 0.0001;  // for each byte in a clock
};

// Where the operations and registers of a shader come from, for TimingModel::kEvents: the constants below, or the table of
// compiled code (hardware/shader_costs.h).
enum class ShaderCosts : std::uint8_t { kConstant, kCompiled };

// Where vertices are shaded: in the tessellator, at a rate of its own, or on the shader's lanes.
enum class DomainShading : std::uint8_t { kUnit, kLanes };

// The shader lanes of a core.
struct PixelShader {
  ShaderCosts costs = ShaderCosts::kConstant;
  DomainShading domain = DomainShading::kUnit;
  std::int64_t lanes = 32;
  std::int64_t warp_lanes = 32;
  double operations = 160;
  double surface_operations = 130;
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
enum class MemoryType : std::uint8_t { kLpddr4x4266, kLpddr5_6400, kLpddr5x8533 };

// The external memory.
struct MemoryInterface {
  MemoryModel model = MemoryModel::kFluid;
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

// Whether the next frame is binned while a frame's tiles are rendered.
enum class FrameOverlap : std::uint8_t { kNone, kFrames };

// Queues, latencies and bounds of what is under way, for TimingModel::kEvents.
struct QueueSizes {
  TimingModel model = TimingModel::kPhases;
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

// What one event of each unit costs, up to what samples see.
struct GeometryPrices {
  double bound_pj = 1000;
  double entry_pj = 20;
  double sort_step_pj = 3;
  double vertex_pj = 150;
  double transform_pj = 46;
  double box_pj = 20;
  double box_test_pj = 2;
  double stencil_test_pj = 1;
  double sampling_operation_pj = 1.5;
  double triangle_test_pj = 8;
  double alpha_test_pj = 20;
  double depth_block_pj = 320;
  double hit_pj = 12;
};

// What one event of each unit costs from there on, and what a mm2 leaks.
struct EnergyPrices {
  double compacted_sample_pj = 1;
  double shader_operation_pj = 1.5;
  double texel_pj = 15;
  double l2_line_pj = 200;
  double blend_pj = 5;
  double resolved_pixel_pj = 20;
  double resolve_operation_pj = 1;
  double leakage_mw_per_mm2 = 10;
};

// Silicon of a unit that does one thing in a clock, of a lane, of a KiB (hardware/area.h).
struct AreaPrices {
  double bound_mm2 = 1;
  double binned_entry_mm2 = 0.1;
  double core_mm2 = 0.15;
  double vertex_mm2 = 0.12;
  double test_mm2 = 0.003;
  double lane_mm2 = 0.008;
  double texel_mm2 = 0.08;
  double pixel_mm2 = 0.01;
  double sram_mm2_per_kib = 0.0005;
  double register_mm2_per_kib = 0.001;
};

// What stands before the binner of machines that bin or draw triangles (baselines/).
struct TriangleUnit {
  double triangles_per_clk = 1;
  double triangle_pj = 25;
};

// The memory has its own clock and its own supply: another clock of the GPU leaves both alone.
struct Machine {
  double clock_mhz = 850;
  double nominal_mhz = 850;  // at which the energies hold (hardware/voltage.h)
  TileCores cores;
  Throughputs rates;
  ReprojectionUnit reprojection;
  SignatureUnits signatures;
  PixelShader shader;
  Caches caches;
  MemoryInterface memory;
  QueueSizes queues;
  GeometryPrices geometry_energy;
  EnergyPrices energy;
  AreaPrices area;
  TriangleUnit triangles;

  // The memory's rate and latency in clocks of the GPU.
  double bytes_per_clk() const { return memory.gb_per_s * 1e3 / clock_mhz; }
  double latency_clk() const { return memory.latency_ns * clock_mhz * 1e-3; }
  void set_bytes_per_clk(double bytes) { memory.gb_per_s = bytes * clock_mhz * 1e-3; }
  void set_latency_clk(double clk) { memory.latency_ns = clk * 1e3 / clock_mhz; }

  // A line of the texture caches and the L2: at least a burst.
  std::int64_t line_bytes() const { return std::max(Caches::kLineBytes, memory.burst_bytes); }
};

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
inline constexpr auto kEnumWords<hardware::MemoryType> = std::to_array<std::string_view>({"lpddr4x-4266", "lpddr5-6400",
                                                                                          "lpddr5x-8533"});
template <>
inline constexpr auto kEnumWords<hardware::FrameCaches> = std::to_array<std::string_view>({"empty", "warm"});
template <>
inline constexpr auto kEnumWords<hardware::FrameOverlap> = std::to_array<std::string_view>({"none", "frames"});
template <>
inline constexpr auto kEnumWords<hardware::TimingModel> = std::to_array<std::string_view>({"phases", "events"});

}  // namespace tessera
