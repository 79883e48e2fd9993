#include "hardware/energy.h"

namespace tessera::hardware {

double FrameEnergy::total_nj() const {
  double sum = 0;
  for (const auto& [unit, nj] : by_unit_nj) sum += nj;
  return sum;
}

void FrameEnergy::accumulate(const FrameEnergy& frame) {
  for (const auto& [unit, nj] : frame.by_unit_nj) by_unit_nj[unit] += nj;
}

FrameEnergy frame_energy(const GpuConfiguration& gpu, const FrameWork& work, double cycles) {
  FrameEnergy energy;
  const auto add = [&](std::string_view unit, double events, double pj) {
    energy.by_unit_nj[std::string(unit)] += events * pj * 1e-3;
  };
  const auto count = [&](Stage stage, std::uint64_t events, double pj) {
    add(name(stage), static_cast<double>(events), pj);
  };
  // Whole numbers first: sums of events are exact in any order.
  GeometryWork geometry;
  TileWork tiles;
  for (const WorkRound& round : work.rounds) {
    geometry.bounds += round.geometry.bounds;
    geometry.sampling_operations += round.geometry.sampling_operations;
    geometry.entries += round.geometry.entries;
    for (const TileWork& tile : round.tiles)
      for (const auto member :
           {&TileWork::entries, &TileWork::vertices, &TileWork::boxes, &TileWork::box_tests, &TileWork::stencil_tests,
            &TileWork::sampling_operations, &TileWork::triangle_tests, &TileWork::hits, &TileWork::alpha_tests,
            &TileWork::shader_runs, &TileWork::texels, &TileWork::l2_lines, &TileWork::blended_layers,
            &TileWork::pixels, &TileWork::resolve_operations})
        tiles.*member += tile.*member;
  }
  count(Stage::kFrontend, geometry.bounds, gpu.energy_bound_pj);
  count(Stage::kBinner, geometry.entries, gpu.energy_binned_entry_pj);
  count(Stage::kFetch, tiles.entries, gpu.energy_fetched_entry_pj);
  count(Stage::kTessellator, tiles.vertices, gpu.energy_vertex_pj);
  count(Stage::kBoxes, tiles.boxes, gpu.energy_box_pj);
  count(Stage::kBoxTests, tiles.box_tests, gpu.energy_box_test_pj);
  count(Stage::kStencil, tiles.stencil_tests, gpu.energy_stencil_test_pj);
  count(Stage::kSampling, geometry.sampling_operations + tiles.sampling_operations, gpu.energy_sampling_operation_pj);
  count(Stage::kTriangleTests, tiles.triangle_tests, gpu.energy_triangle_test_pj);
  count(Stage::kTriangleTests, tiles.hits, gpu.energy_hit_pj);
  count(Stage::kAlphaTests, tiles.alpha_tests, gpu.energy_alpha_test_pj);
  count(Stage::kShader, tiles.shader_runs, gpu.energy_shader_operation_pj * gpu.shader_operations);
  count(Stage::kTexture, tiles.texels, gpu.energy_texel_pj);
  add("l2", static_cast<double>(tiles.l2_lines), gpu.energy_l2_line_pj);
  count(Stage::kBlend, tiles.blended_layers, gpu.energy_blend_pj);
  count(Stage::kResolve, tiles.pixels, gpu.energy_resolved_pixel_pj);
  count(Stage::kResolve, tiles.resolve_operations, gpu.energy_resolve_operation_pj);
  count(Stage::kDram, work.dram_bytes() * 8, gpu.memory_pj_per_bit);
  // 1 mW for 1 us is 1 nJ.
  energy.by_unit_nj["leakage"] = gpu.energy_leakage_mw * cycles / gpu.clock_mhz;
  return energy;
}

}  // namespace tessera::hardware
