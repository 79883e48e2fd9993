#include "timing/work.h"

#include <algorithm>

namespace tessera::timing {
namespace {

double share(std::uint64_t events, double per_clk) { return static_cast<double>(events) / per_clk; }

bool on_lanes(const hardware::Machine& gpu) { return gpu.shader.domain == hardware::DomainShading::kLanes; }
// Of a core, with constant costs.
double vertex_cycles(const hardware::Machine& gpu, std::uint64_t vertices) {
  return on_lanes(gpu)
             ? static_cast<double>(vertices) * gpu.shader.surface_operations / static_cast<double>(gpu.shader.lanes)
             : share(vertices, gpu.rates.vertices_per_clk);
}

}  // namespace

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
    events.bounds += round.geometry.bounds;
    events.reprojected_blocks += round.geometry.depth_blocks;
    events.depth_tests += round.geometry.depth_tests;
    events.sampling_operations += round.geometry.sampling_operations;
    events.binned_entries += round.geometry.entries;
    events.hashed_inputs += round.geometry.hashed_bytes;
    events.vertices += round.triangles.vertices;
    events.triangles += round.triangles.triangles;
    for (const TileWork& tile : round.tiles) {
      events.fetched_entries += tile.entries;
      events.sort_steps += tile.sort_steps;
      events.vertices += tile.vertices;
      events.domain_texels += tile.domain_texels;
      events.transforms += tile.transforms;
      events.boxes += tile.boxes;
      events.box_tests += tile.box_tests;
      events.stencil_tests += tile.stencil_tests;
      events.sampling_operations += tile.sampling_operations;
      events.triangle_tests += tile.triangle_tests;
      events.hits += tile.hits;
      events.alpha_tests += tile.alpha_tests;
      events.depth_blocks += tile.depth_blocks;
      events.compacted_samples += tile.compacted_samples;
      events.shader_invocations += tile.shader_invocations;
      events.surface_evaluations += tile.surface_evaluations;
      events.texels += tile.texels;
      events.l2_lines += tile.l2_lines;
      events.blended_layers += tile.blended_layers;
      events.pixels += tile.pixels;
      events.resolve_operations += tile.resolve_operations;
      events.hashed_colors += tile.hashed_bytes;
    }
  }
  events.dram_bytes = work.dram_bytes();
  return events;
}

std::uint64_t compiled_clocks(const hardware::Machine& gpu, const TileItems& items) {
  std::uint64_t clocks = 0;
  for (const WarpItem& warp : items.warps) clocks += std::uint64_t{warp.lanes} * warp.clocks;
  if (on_lanes(gpu))
    for (const SubPatchItem& item : items.sub_patches) clocks += std::uint64_t{item.vertices} * item.domain_clocks;
  return clocks;
}

void take_compiled(const hardware::Machine& gpu, std::uint64_t clocks, hardware::EnergyEvents& events) {
  events.shader_invocations = events.surface_evaluations = 0;
  if (on_lanes(gpu)) events.vertices = 0;
  events.shader_clocks = clocks;
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

StageCycles stage_cycles(const hardware::Machine& gpu, const GeometryWork& work) {
  StageCycles cycles{};
  const auto at = [&](Stage stage) -> double& { return cycles[static_cast<std::size_t>(stage)]; };
  // Nothing is tested before the last block is in its place; bounds and tests are made side by side.
  at(Stage::kFrontend) = share(work.depth_blocks, gpu.reprojection.reprojected_blocks_per_clk) +
                         std::max(share(work.bounds, gpu.rates.bounds_per_clk),
                                  share(work.depth_tests, gpu.reprojection.depth_tests_per_clk)) +
                         share(work.sampling_operations, gpu.rates.sampling_operations_per_clk);
  // Appending, testing and hashing are parts of the binner that work side by side.
  at(Stage::kBinner) = std::max({share(work.entries, gpu.rates.binned_entries_per_clk),
                                 share(work.tiles_tested, gpu.rates.binned_tiles_per_clk),
                                 share(work.hashed_bytes, gpu.signatures.input_bytes_per_clk)});
  at(Stage::kDram) = share(work.dram_bytes, memory_rate(gpu));
  return cycles;
}

StageCycles geometry_cycles(const hardware::Machine& gpu, const WorkRound& round) {
  StageCycles cycles = stage_cycles(gpu, round.geometry);
  double& frontend = cycles[static_cast<std::size_t>(Stage::kFrontend)];
  frontend = std::max({frontend, vertex_cycles(gpu, round.triangles.vertices) / static_cast<double>(gpu.cores.count),
                       share(round.triangles.triangles, gpu.triangles.triangles_per_clk)});
  return cycles;
}

StageCycles stage_cycles(const hardware::Machine& gpu, const TileWork& work) {
  StageCycles cycles{};
  const auto at = [&](Stage stage) -> double& { return cycles[static_cast<std::size_t>(stage)]; };
  // Nothing leaves the sorter before the last entry is in it.
  at(Stage::kFetch) =
      share(work.entries, gpu.rates.fetched_entries_per_clk) + share(work.sort_steps, gpu.rates.sort_steps_per_clk);
  at(on_lanes(gpu) ? Stage::kShader : Stage::kTessellator) = vertex_cycles(gpu, work.vertices);
  at(Stage::kTessellator) += share(work.transforms, gpu.rates.transforms_per_clk);
  at(Stage::kBoxes) = share(work.boxes, gpu.rates.boxes_per_clk);
  at(Stage::kBoxTests) = share(work.box_lanes, gpu.rates.box_tests_per_clk);
  at(Stage::kStencil) = share(work.stencil_tests, gpu.rates.stencil_tests_per_clk);
  at(Stage::kSampling) = share(work.sampling_operations, gpu.rates.sampling_operations_per_clk);
  at(Stage::kTriangleTests) = share(work.triangle_lanes, gpu.rates.triangle_tests_per_clk);
  at(Stage::kAlphaTests) = share(work.alpha_tests, gpu.rates.alpha_tests_per_clk);
  at(Stage::kCoarseDepth) = share(work.depth_blocks, gpu.rates.depth_blocks_per_clk);
  at(Stage::kCompaction) = share(work.compacted_samples, gpu.rates.compacted_samples_per_clk);
  at(Stage::kShader) += (static_cast<double>(work.shader_lanes) * gpu.shader.operations +
                         static_cast<double>(work.surface_lanes) * gpu.shader.surface_operations) /
                        static_cast<double>(gpu.shader.lanes);
  at(Stage::kTexture) = share(work.texels + (on_lanes(gpu) ? work.domain_texels : 0), gpu.rates.texels_per_clk);
  at(Stage::kBlend) = share(work.blended_layers, gpu.rates.blends_per_clk);
  // Colours are hashed as they are resolved.
  at(Stage::kResolve) = std::max(share(work.pixels, gpu.rates.resolved_pixels_per_clk) +
                                     share(work.resolve_operations, gpu.rates.resolve_operations_per_clk),
                                 share(work.hashed_bytes, gpu.signatures.color_bytes_per_clk));
  at(Stage::kDram) = share(work.dram_bytes[0] + work.dram_bytes[1] + work.dram_bytes[2], memory_rate(gpu));
  return cycles;
}

}  // namespace tessera::timing
