// Shipped machines, and mesh shaders, on the captures: results that they share with the other schemes, and their own.
#include "baselines/geometry_pass.h"
#include "baselines/immediate.h"
#include "baselines/meshlets.h"
#include "replay/baseline_report.h"
#include "scene/capture_reader.h"
#include "tests/replay/compared.h"
#include "tests/support/tests.h"

namespace tessera::replay::shipped_baselines_test {
namespace {

using baselines::BaselineCounters;
using baselines::SchemeId;
using test::Compared;
using test::has_patches;
using test::kMeshShaders;
using test::look_at;
using test::render;

class ShippedBaselines : public testing::TestWithParam<const char*> {
 protected:
  scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  const BaselineCounters& scheme(const Compared& result, SchemeId s) { return (*result.baselines)[s]; }
};

// A driver that draws passes with tessellation without tiles; other passes it bins into visibility streams.
TEST_P(ShippedBaselines, UntiledDrawsPatchesAtOnceAndBinsTriangles) {
  gpu::GpuConfiguration plain;
  plain.baselines.immediate_color_compression = false;
  const Compared r = render(capture, {}), of_plain = render(capture, plain);
  const json schemes = baselines_json(*r.baselines), without = baselines_json(*of_plain.baselines);
  EXPECT_EQ(schemes["untiled"], schemes[has_patches(capture) ? "immediate" : "visibility-stream"]);
  EXPECT_EQ(without["untiled"], schemes["untiled"]) << "it compresses whatever immediate does";
  EXPECT_LE(scheme(r, SchemeId::kImmediate).dram_bytes, scheme(of_plain, SchemeId::kImmediate).dram_bytes);
}

// A compute tessellator adds its blocks to the bytes of deferred-vertex, and nothing where there is no patch.
TEST_P(ShippedBaselines, ATessellatorInMemoryAddsPointsAndIndices) {
  const Compared r = render(capture, {});
  const BaselineCounters &deferred = scheme(r, SchemeId::kDeferredVertex),
                         &stored = scheme(r, SchemeId::kTessellatedInMemory);
  EXPECT_EQ(stored.entries, deferred.entries);
  EXPECT_EQ(stored.domain_evaluations_cached, deferred.domain_evaluations_cached);
  EXPECT_EQ(stored.frame_bytes_written, deferred.frame_bytes_written);
  if (!has_patches(capture)) {
    EXPECT_EQ(stored.dram_bytes, deferred.dram_bytes);
    EXPECT_EQ(stored.cycles, deferred.cycles);
    return;
  }
  // An index takes 12 bytes for each triangle in view at least; a block is written and read.
  EXPECT_GT(stored.queue_bytes_written, deferred.queue_bytes_written + 12 * stored.primitives);
  EXPECT_GE(stored.dram_bytes, deferred.dram_bytes + 2 * (stored.queue_bytes_written - deferred.queue_bytes_written));
  EXPECT_GT(stored.energy_nj, deferred.energy_nj);
}

// Task shaders leave fewer triangles; the store between them and the tiles is largest as a ring and smallest as
// references.
TEST_P(ShippedBaselines, MeshShadersKeepTheDataOfTheirStore) {
  const Compared r = render(capture, {});
  const BaselineCounters &ring = scheme(r, SchemeId::kMeshShaderRing),
                         &compact = scheme(r, SchemeId::kMeshShaderCompact),
                         &references = scheme(r, SchemeId::kMeshShaderReferences),
                         &deferred = scheme(r, SchemeId::kDeferredVertex);
  for (const SchemeId s : kMeshShaders) {
    EXPECT_LE(scheme(r, s).primitives, deferred.primitives);
    EXPECT_EQ(scheme(r, s).primitives, ring.primitives);
    EXPECT_EQ(scheme(r, s).tile_overlaps, ring.tile_overlaps);
    EXPECT_EQ(scheme(r, s).culled_occlusion, ring.culled_occlusion);
  }
  EXPECT_EQ(ring.domain_evaluations, compact.domain_evaluations);
  EXPECT_EQ(references.position_evaluations, ring.domain_evaluations) << "once to bin, and in tiles again";
  EXPECT_GT(references.domain_evaluations, 0u);
  EXPECT_GT(ring.queue_bytes_written, compact.queue_bytes_written);
  EXPECT_GT(compact.queue_bytes_written, references.queue_bytes_written);
  // A pyramid of half a byte more than two for 8x8 pixels, in bursts: read and written.
  EXPECT_EQ(references.frame_bytes_read, (2u * (20 * 12 + 10 * 6 + 5 * 3 + 3 * 2 + 2 * 1 + 1) + 63) / 64 * 64);
  EXPECT_EQ(references.frame_bytes_written, deferred.frame_bytes_written + references.frame_bytes_read);
}

// MS1, and its failing twin: all depths are nearer than the seen surface.
TEST_P(ShippedBaselines, MS1TaskShadersKeepEveryTriangleThatIsSeen) {
  look_at(capture, [](const gpu::RenderedView& view) {
    const baselines::ImmediateFrame drawn = baselines::draw_immediately(view.job, view.record, view.gpu);
    std::set<std::uint64_t> seen;
    for (const std::vector<std::uint64_t>& tile : drawn.visible.tiles) seen.insert(tile.begin(), tile.end());
    EXPECT_GT(seen.size(), 100u);
    const baselines::TriangleSetup setup(*view.job.grid, view.job.frame->projection);
    baselines::DepthPyramid near(view.job.grid->region());
    for (std::uint32_t tile = 0; tile < view.job.grid->tile_count(); ++tile) {
      const IntRect pixels = view.job.grid->pixels(tile);
      const auto blocks = [](int length) { return static_cast<std::size_t>((length + 7) / 8); };
      near.add(pixels, std::vector<float>(blocks(pixels.width()) * blocks(pixels.height()), 1e-3f));
    }
    near.finish();
    const auto lost = [&](const baselines::DepthPyramid& depths) {
      baselines::TaskShader task(setup, depths);
      std::set<std::uint64_t> left = seen;
      baselines::run_geometry(view.job, view.pyramids, view.gpu, setup, setup, [&](auto some) {
        for (const baselines::DrawnPatch& patch : some)
          for (const baselines::Meshlet& meshlet : task.run(patch.patch, patch.tiles))
            for (const std::uint32_t t : meshlet.numbers)
              left.erase(baselines::triangle_name(patch.patch.number, patch.patch.triangle_numbers[t]));
      });
      return left.size();
    };
    EXPECT_EQ(lost(drawn.depths), 0u);
    EXPECT_GT(lost(near), seen.size() / 2);
  });
}

INSTANTIATE_TEST_SUITE_P(All, ShippedBaselines, testing::Values("eggs", "vases", "serpent", "flyby"),
                         [](const auto& named) { return std::string(named.param); });

}  // namespace
}  // namespace tessera::replay::shipped_baselines_test
