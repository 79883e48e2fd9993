#include "hardware/energy.h"

#include <cmath>

#include "hardware/stage.h"
#include "hardware/voltage.h"

namespace tessera::hardware {

double FrameEnergy::total_nj() const {
  double sum = 0;
  for (const auto& [unit, nj] : by_unit_nj) sum += nj;
  return sum;
}

void FrameEnergy::accumulate(const FrameEnergy& frame) {
  for (const auto& [unit, nj] : frame.by_unit_nj) by_unit_nj[unit] += nj;
}

namespace {

// Of an access to a memory on chip against one to the default's.
double access_ratio(std::int64_t bytes, std::int64_t default_bytes) {
  return std::sqrt(static_cast<double>(bytes) / static_cast<double>(default_bytes));
}

}  // namespace

FrameEnergy frame_energy(const Machine& gpu, const EnergyEvents& events, double cycles, double mm2) {
  FrameEnergy energy;
  const double voltage = supply_volts(gpu.clock_mhz, gpu.nominal_mhz) / kNominalVolts, square = voltage * voltage;
  const double tile_memory = access_ratio(gpu.cores.memory_bytes, TileCores().memory_bytes),
               texture_cache = access_ratio(gpu.caches.texture_bytes, Caches().texture_bytes),
               l2 = access_ratio(gpu.caches.l2_bytes, Caches().l2_bytes);
  const auto add = [&](std::string_view unit, double count, double pj) {
    energy.by_unit_nj[std::string(unit)] += count * pj * square * 1e-3;
  };
  const auto count = [&](Stage stage, std::uint64_t number, double pj) {
    add(name(stage), static_cast<double>(number), pj);
  };
  count(Stage::kFrontend, events.bounds, gpu.geometry_energy.bound_pj);
  count(Stage::kFrontend, events.reprojected_blocks, gpu.reprojection.reprojected_block_pj);
  count(Stage::kFrontend, events.depth_tests, gpu.reprojection.depth_test_pj);
  count(Stage::kFrontend, events.triangles, gpu.triangles.triangle_pj);
  count(Stage::kBinner, events.binned_entries, gpu.geometry_energy.entry_pj);
  count(Stage::kBinner, events.hashed_inputs, gpu.signatures.byte_pj);
  count(Stage::kFetch, events.fetched_entries, gpu.geometry_energy.entry_pj);
  count(Stage::kFetch, events.sort_steps, gpu.geometry_energy.sort_step_pj);
  const bool on_lanes = gpu.shader.domain == DomainShading::kLanes;
  if (!on_lanes) count(Stage::kTessellator, events.vertices, gpu.geometry_energy.vertex_pj);
  count(Stage::kTessellator, events.transforms, gpu.geometry_energy.transform_pj);
  count(Stage::kBoxes, events.boxes, gpu.geometry_energy.box_pj);
  count(Stage::kBoxTests, events.box_tests, gpu.geometry_energy.box_test_pj);
  count(Stage::kStencil, events.stencil_tests, gpu.geometry_energy.stencil_test_pj);
  count(Stage::kSampling, events.sampling_operations, gpu.geometry_energy.sampling_operation_pj);
  count(Stage::kTriangleTests, events.triangle_tests, gpu.geometry_energy.triangle_test_pj);
  count(Stage::kTriangleTests, events.hits, gpu.geometry_energy.hit_pj * tile_memory);
  count(Stage::kAlphaTests, events.alpha_tests, gpu.geometry_energy.alpha_test_pj);
  count(Stage::kCoarseDepth, events.depth_blocks, gpu.geometry_energy.depth_block_pj * tile_memory);
  count(Stage::kCompaction, events.compacted_samples, gpu.energy.compacted_sample_pj);
  count(Stage::kShader, events.surface_evaluations, gpu.energy.shader_operation_pj * gpu.shader.surface_operations);
  count(Stage::kShader, events.shader_clocks, gpu.energy.shader_operation_pj);
  count(Stage::kShader, events.shader_invocations, gpu.energy.shader_operation_pj * gpu.shader.operations);
  if (on_lanes) count(Stage::kShader, events.vertices, gpu.energy.shader_operation_pj * gpu.shader.surface_operations);
  count(Stage::kTexture, events.texels + (on_lanes ? events.domain_texels : 0),
        gpu.energy.texel_pj * (2 + texture_cache) / 3);
  add("l2", static_cast<double>(events.l2_lines), gpu.energy.l2_line_pj * l2);
  count(Stage::kBlend, events.blended_layers, gpu.energy.blend_pj);
  count(Stage::kResolve, events.pixels, gpu.energy.resolved_pixel_pj);
  count(Stage::kResolve, events.resolve_operations, gpu.energy.resolve_operation_pj);
  count(Stage::kResolve, events.hashed_colors, gpu.signatures.byte_pj);
  energy.by_unit_nj[std::string(name(Stage::kDram))] =
      static_cast<double>(events.dram_bytes * 8) * gpu.memory.pj_per_bit * 1e-3;
  // 1 mW for 1 us is 1 nJ.
  energy.by_unit_nj["leakage"] = gpu.energy.leakage_mw_per_mm2 * mm2 * voltage * cycles / gpu.clock_mhz;
  return energy;
}

}  // namespace tessera::hardware
