#pragma once

#include <cstdint>

namespace tessera::hardware {

// Speeds, sizes and energies of the described machine: what the timing and the energy model read and nothing else does.
// Part of GpuConfiguration; keys, units, ranges and sources are in machine_keys.cpp. Values are those of the preset
// "middle". A throughput is that of one instance of the unit: the front end and the binner exist once, the units of a
// tile core once in each core.
struct MachineNumbers {
  double clock_mhz = 850;
  std::int64_t tilecore_count = 4;
  std::int64_t tilecore_memory_bytes = 192 << 10;

  double frontend_bounds_per_clk = 0.25;
  double binner_entries_per_clk = 1;
  double binner_tiles_per_clk = 4;

  double tilecore_entries_per_clk = 0.5;
  double tessellator_vertices_per_clk = 1;
  double tilecore_boxes_per_clk = 1;
  double tilecore_box_tests_per_clk = 16;
  double tilecore_stencil_tests_per_clk = 32;
  double sampling_operations_per_clk = 32;
  double tilecore_triangle_tests_per_clk = 16;
  double tilecore_alpha_tests_per_clk = 4;
  std::int64_t shader_lanes = 32;
  double shader_operations = 160;
  double texture_texels_per_clk = 2;
  double tilecore_blends_per_clk = 4;
  double resolve_pixels_per_clk = 4;
  double resolve_operations_per_clk = 16;

  std::int64_t cache_line_bytes = 64;
  std::int64_t texture_cache_bytes = 16 << 10;
  std::int64_t texture_cache_ways = 4;
  std::int64_t l2_bytes = 256 << 10;
  std::int64_t l2_ways = 8;

  double memory_bytes_per_clk = 40.1;
  double memory_gpu_share = 0.7;
  double memory_latency_clk = 192;
  double memory_pj_per_bit = 12.5;

  double energy_bound_pj = 1000;
  double energy_binned_entry_pj = 20;
  double energy_fetched_entry_pj = 20;
  double energy_vertex_pj = 150;
  double energy_box_pj = 20;
  double energy_box_test_pj = 2;
  double energy_stencil_test_pj = 1;
  double energy_sampling_operation_pj = 1.5;
  double energy_triangle_test_pj = 8;
  double energy_alpha_test_pj = 20;
  double energy_hit_pj = 12;
  double energy_shader_operation_pj = 1.5;
  double energy_texel_pj = 15;
  double energy_l2_line_pj = 200;
  double energy_blend_pj = 5;
  double energy_resolved_pixel_pj = 20;
  double energy_resolve_operation_pj = 1;
  double energy_leakage_mw = 60;
};

}  // namespace tessera::hardware
