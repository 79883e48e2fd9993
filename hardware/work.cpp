#include "hardware/work.h"

#include <algorithm>

namespace tessera::hardware {
namespace {

double share(std::uint64_t events, double per_clk) { return static_cast<double>(events) / per_clk; }

}  // namespace

std::string_view name(Stage stage) {
  static constexpr std::array<std::string_view, kStageCount> kNames = {
      "frontend",       "binner",      "entry_fetch", "tessellator", "box_builder", "box_tests", "stencil", "sampling",
      "triangle_tests", "alpha_tests", "shader",      "texture",     "blend",       "resolve",   "dram"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::uint64_t FrameWork::dram_bytes() const {
  std::uint64_t bytes = other_bytes;
  for (const WorkRound& round : rounds) {
    bytes += round.geometry.dram_bytes;
    for (const TileWork& tile : round.tiles)
      for (const std::uint64_t phase : tile.dram_bytes) bytes += phase;
  }
  return bytes;
}

Phase phase_of(Unit unit, Purpose purpose, bool write) {
  if (unit == Unit::kResolve || write) return Phase::kStore;
  return purpose == Purpose::kTexture ? Phase::kShading : Phase::kVisibility;
}

std::array<std::uint64_t, kPhaseCount> phase_bytes(const Ledger& ledger) {
  std::array<std::uint64_t, kPhaseCount> bytes{};
  for (std::size_t u = 0; u < kUnitCount; ++u)
    for (std::size_t p = 0; p < kPurposeCount; ++p) {
      const auto unit = static_cast<Unit>(u);
      const auto purpose = static_cast<Purpose>(p);
      const Traffic& traffic = ledger.traffic(unit, purpose);
      bytes[static_cast<std::size_t>(phase_of(unit, purpose, false))] += traffic.read_bytes;
      bytes[static_cast<std::size_t>(phase_of(unit, purpose, true))] += traffic.written_bytes;
    }
  return bytes;
}

StageCycles stage_cycles(const GpuConfiguration& gpu, const GeometryWork& work) {
  StageCycles cycles{};
  const auto at = [&](Stage stage) -> double& { return cycles[static_cast<std::size_t>(stage)]; };
  at(Stage::kFrontend) = share(work.bounds, gpu.frontend_bounds_per_clk) +
                         share(work.sampling_operations, gpu.sampling_operations_per_clk);
  // Appending and testing are two parts of the binner that work side by side.
  at(Stage::kBinner) =
      std::max(share(work.entries, gpu.binner_entries_per_clk), share(work.tiles_tested, gpu.binner_tiles_per_clk));
  at(Stage::kDram) = share(work.dram_bytes, memory_rate(gpu));
  return cycles;
}

StageCycles stage_cycles(const GpuConfiguration& gpu, const TileWork& work) {
  StageCycles cycles{};
  const auto at = [&](Stage stage) -> double& { return cycles[static_cast<std::size_t>(stage)]; };
  at(Stage::kFetch) = share(work.entries, gpu.tilecore_entries_per_clk);
  at(Stage::kTessellator) = share(work.vertices, gpu.tessellator_vertices_per_clk);
  at(Stage::kBoxes) = share(work.boxes, gpu.tilecore_boxes_per_clk);
  at(Stage::kBoxTests) = share(work.box_tests, gpu.tilecore_box_tests_per_clk);
  at(Stage::kStencil) = share(work.stencil_tests, gpu.tilecore_stencil_tests_per_clk);
  at(Stage::kSampling) = share(work.sampling_operations, gpu.sampling_operations_per_clk);
  at(Stage::kTriangleTests) = share(work.triangle_tests, gpu.tilecore_triangle_tests_per_clk);
  at(Stage::kAlphaTests) = share(work.alpha_tests, gpu.tilecore_alpha_tests_per_clk);
  at(Stage::kShader) =
      static_cast<double>(work.shader_runs) * gpu.shader_operations / static_cast<double>(gpu.shader_lanes);
  at(Stage::kTexture) = share(work.texels, gpu.texture_texels_per_clk);
  at(Stage::kBlend) = share(work.blended_layers, gpu.tilecore_blends_per_clk);
  at(Stage::kResolve) =
      share(work.pixels, gpu.resolve_pixels_per_clk) + share(work.resolve_operations, gpu.resolve_operations_per_clk);
  at(Stage::kDram) = share(work.dram_bytes[0] + work.dram_bytes[1] + work.dram_bytes[2], memory_rate(gpu));
  return cycles;
}

}  // namespace tessera::hardware
