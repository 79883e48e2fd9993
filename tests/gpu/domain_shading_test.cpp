// Vertices on the lanes and tables through the L2, of frames that the machine rendered.
#include "base/error.h"
#include "gpu/device.h"
#include "gpu/machine_model.h"
#include "hardware/shader_costs.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"
#include "timing/events/event_model.h"

namespace tessera::gpu::domain_shading_test {
namespace {

using hardware::DomainShading;
using hardware::ShaderCosts;

// A frame of a shipped capture with its items.
FrameResult recorded(const char* capture) {
  const scene::Capture read = scene::read_capture(test::shipped_capture(capture));
  RenderRequest request{240, 135, {0, 0, 240, 135}};
  request.record_items = true;
  return Device(read, {}, RunSettings(), request).render(5);
}

GpuConfiguration machine(DomainShading domain, ShaderCosts costs = ShaderCosts::kCompiled) {
  GpuConfiguration gpu;
  gpu.queues.model = hardware::TimingModel::kEvents;
  gpu.shader.costs = costs;
  gpu.shader.domain = domain;
  return gpu;
}

std::uint64_t vertices_of(const timing::FrameWork& work) {
  std::uint64_t vertices = 0;
  for (const timing::WorkRound& round : work.rounds)
    for (const timing::TileWork& tile : round.tiles) vertices += tile.events[hardware::Event::kVertices];
  return vertices;
}

TEST(DomainShading, RecordsNameTheShaderOfEachSubPatch) {
  for (const char* capture : {"eggs", "serpent", "workshop"}) {
    const timing::FrameWork work = recorded(capture).model->record.work;
    std::uint64_t texels = 0, heights = 0;
    for (const timing::WorkRound& round : work.rounds)
      for (std::size_t t = 0; t < round.tiles.size(); ++t) {
        std::uint64_t vertices = 0, of_tile = 0;
        for (const timing::SubPatchItem& item : round.items[t].sub_patches) {
          vertices += item[hardware::Event::kVertices];
          of_tile += std::uint64_t{item[hardware::Event::kVertices]} * item.domain_texels;
          heights += item.height_lines;
          EXPECT_EQ(item.domain_clocks > 0, item[hardware::Event::kVertices] > 0);
          EXPECT_EQ(item.domain_registers > 0, item[hardware::Event::kVertices] > 0);
          EXPECT_TRUE(item.domain_texels > 0 || item.height_lines == 0);
        }
        EXPECT_EQ(vertices, round.tiles[t].events[hardware::Event::kVertices]);
        EXPECT_EQ(of_tile, round.tiles[t].events[hardware::Event::kDomainTexels]);
        texels += of_tile;
      }
    EXPECT_EQ(texels > 0, heights > 0) << capture;
    EXPECT_EQ(texels > 0, std::string(capture) == "eggs") << capture;
  }
}

TEST(DomainShading, LanesShadeEveryVertexOnceAndPayByOperations) {
  const std::vector<timing::FrameWork> work = {recorded("eggs").model->record.work};
  for (const ShaderCosts costs : {ShaderCosts::kConstant, ShaderCosts::kCompiled}) {
    const GpuConfiguration gpu = machine(DomainShading::kLanes, costs);
    const ViewCost lanes = view_cost(gpu, work[0]), unit = view_cost(machine(DomainShading::kUnit, costs), work[0]);
    const timing::DomainCounts& domain = lanes.timing.events->domain;
    EXPECT_EQ(domain.vertices, vertices_of(work[0]));
    EXPECT_EQ(unit.timing.events->domain.vertices, 0u);
    EXPECT_GT(domain.texels, 0u);
    double clocks = static_cast<double>(vertices_of(work[0])) * gpu.shader.surface_operations;
    if (costs == ShaderCosts::kCompiled) {
      clocks = 0;
      for (const timing::WorkRound& round : work[0].rounds)
        for (const timing::TileItems& items : round.items)
          for (const timing::SubPatchItem& item : items.sub_patches)
            clocks += static_cast<double>(item[hardware::Event::kVertices]) * item.domain_clocks;
    }
    const auto more = [&](const char* of) { return lanes.energy.by_unit_nj.at(of) - unit.energy.by_unit_nj.at(of); };
    EXPECT_NEAR(more("shader"), clocks * gpu.energy_pj[hardware::Event::kShaderClocks] * 1e-3, 1e-6 * clocks);
    EXPECT_NEAR(more("texture"), static_cast<double>(domain.texels) * gpu.energy_pj[hardware::Event::kTexels] * 1e-3,
                1e-3);
    EXPECT_NEAR(more("tessellator"),
                -static_cast<double>(vertices_of(work[0])) * gpu.energy_pj[hardware::Event::kVertices] * 1e-3, 1e-3);
    // With phases the same operations are work of the same lanes.
    GpuConfiguration phases = gpu;
    phases.queues.model = hardware::TimingModel::kPhases;
    const double busy =
        timing::stage_cycles(phases, work[0].rounds[0].tiles[0])[static_cast<std::size_t>(hardware::Stage::kShader)];
    phases.shader.surface_operations *= 2;
    const double twice =
        timing::stage_cycles(phases, work[0].rounds[0].tiles[0])[static_cast<std::size_t>(hardware::Stage::kShader)];
    EXPECT_NEAR(twice - busy,
                static_cast<double>(work[0].rounds[0].tiles[0].events[hardware::Event::kVertices] +
                                    work[0].rounds[0].tiles[0].events[hardware::Event::kVertexOutputLanes]) *
                    gpu.shader.surface_operations / static_cast<double>(gpu.shader.lanes),
                1e-6);
  }
}

TEST(DomainShading, MoreLanesAreNoSlower) {
  for (const char* capture : {"eggs", "serpent", "workshop", "vases"}) {
    const std::vector<timing::FrameWork> work = {recorded(capture).model->record.work};
    for (const ShaderCosts costs : {ShaderCosts::kConstant, ShaderCosts::kCompiled}) {
      GpuConfiguration gpu = machine(DomainShading::kLanes, costs);
      double before = std::numeric_limits<double>::infinity();
      for (const std::int64_t lanes : {8, 16, 32, 64}) {
        gpu.shader.lanes = lanes;
        const double cycles = cycle_cost(gpu, work).cycles;
        EXPECT_LE(cycles, 1.005 * before) << capture << " " << lanes;
        before = cycles;
      }
      // The same twice.
      EXPECT_EQ(cycle_cost(gpu, work).cycles, before);
    }
  }
}

TEST(DomainShading, AVertexThatNeedsMoreRegistersThanThereAreIsRefused) {
  const timing::FrameWork work = recorded("eggs").model->record.work;
  std::int64_t pixels = 0;
  for (const timing::TileItems& items : work.rounds[0].items)
    for (const timing::WarpItem& warp : items.warps) pixels = std::max<std::int64_t>(pixels, warp.registers);
  timing::FrameWork large = work;
  for (timing::TileItems& items : large.rounds[0].items)
    for (timing::SubPatchItem& item : items.sub_patches) item.domain_registers = static_cast<std::uint32_t>(pixels) + 1;
  GpuConfiguration gpu = machine(DomainShading::kLanes);
  gpu.queues.register_bytes = pixels * 4 * gpu.shader.warp_lanes;
  EXPECT_THROW((void)view_cost(gpu, large), UsageError);
  gpu.shader.domain = DomainShading::kUnit;
  EXPECT_NO_THROW((void)view_cost(gpu, large));
}

// ---- The front end's tables -----------------------------------------------------------------------------------------

TEST(GeometryReads, MoveTheLedgersBytesInTime) {
  for (const char* capture : {"eggs", "serpent"}) {
    const FrameResult frame = recorded(capture);
    timing::FrameWork work = frame.model->record.work;
    ASSERT_EQ(work.rounds.size(), 1u);
    timing::WorkRound& round = work.rounds[0];
    const timing::GeometryWork& geometry = round.geometry;
    EXPECT_EQ(round.geometry_lines.size(), frame.counters.frontend.table_lines);
    EXPECT_EQ(geometry.table_bytes,
              frame.counters.ledger.traffic(memory::Unit::kFrontend, memory::Purpose::kTexture).read_bytes);
    EXPECT_EQ(geometry.table_bytes > 0, std::string(capture) == "eggs");
    // The geometry alone, with cold caches, at any depth of its queue.
    round.tiles.clear(), round.items.clear();
    work.other_bytes = work.other_written_bytes = 0;
    double before = std::numeric_limits<double>::infinity();
    for (const std::int64_t lines : {1, 8, 64}) {
      GpuConfiguration gpu = machine(DomainShading::kUnit);
      gpu.queues.table_lines = lines;
      const timing::EventSchedule out = timing::simulate_events(gpu, work);
      EXPECT_EQ(out.counts.memory.read_bytes, geometry.dram_bytes - geometry.written_bytes) << capture << lines;
      EXPECT_EQ(out.counts.memory.l2_misses * 64, geometry.table_bytes) << capture;
      EXPECT_EQ(out.counts.memory.l2_requests, round.geometry_lines.size()) << capture;
      EXPECT_LE(out.schedule.cycles, before) << capture << lines;
      before = out.schedule.cycles;
    }
  }
}

}  // namespace
}  // namespace tessera::gpu::domain_shading_test
