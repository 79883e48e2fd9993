// Work of schemes (baselines/scheme_work.h) on machines of which one thing takes time: cycles known by hand.
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::baselines::scheme_work_test {
namespace {

using hardware::Event;

// A machine with so many lanes that shaders before tiles take no time either.
gpu::GpuConfiguration endless() {
  auto gpu = test::endless_machine<gpu::GpuConfiguration>();
  gpu.shader.lanes = std::int64_t{1} << 60;
  return gpu;
}

// Triangles of a few pixels side by side, which share no vertex, in a frame of one tile; with a texture of one line; in
// as many `draws` of the same number of triangles.
scene::Capture triangles(std::uint32_t count, bool textured = false, std::uint32_t draws = 1) {
  scene::Capture capture;
  scene::Material material;
  material.unlit = true;
  if (textured) {
    Image8 texel(1, 1, 4);
    texel.values = {255, 255, 255, 255};
    material.base_color_texture.texture =
        std::make_shared<shaders::Texture>(DecodedImage{std::move(texel)}, shaders::ColorSpace::kLinear);
  }
  const std::uint32_t shared = test::add_material(capture, material);
  for (std::uint32_t draw = 0; draw < draws; ++draw) {
    std::vector<Vec3> corners;
    std::vector<std::uint32_t> indices;
    for (std::uint32_t t = draw * count / draws; t < (draw + 1) * count / draws; ++t) {
      const float x = count == 1 ? 0 : static_cast<float>(t % 12) * 0.14f - 0.77f,
                  y = count == 1 ? 0 : static_cast<float>(t / 12) * 0.2f - 0.7f;
      for (const Vec2& corner : {Vec2(-0.06f, -0.09f), Vec2(0.06f, -0.09f), Vec2(0, 0.09f)}) {
        indices.push_back(static_cast<std::uint32_t>(corners.size()));
        corners.emplace_back(x + corner.x, y + corner.y, 0.0f);
      }
    }
    scene::Primitive mesh = test::triangles(corners, indices, shared);
    mesh.vertices.texcoords = {std::vector<Vec2>(corners.size(), Vec2(0.5f))};
    test::add_node(capture, std::move(mesh));
  }
  test::add_camera(capture, {0, 0, 2});
  return capture;
}

BaselineSet timed(const gpu::GpuConfiguration& gpu, const scene::Capture& capture, gpu::RunSettings settings = {}) {
  settings.sampling.samples_per_pixel = 1;
  gpu::Device device(capture, gpu, settings, {32, 32, {0, 0, 32, 32}});
  BaselineObserver schemes;
  device.set_observer(&schemes);
  device.render(0);
  return schemes.last();
}

// By scheme, in their order: tessera, patch-whole, post-tessellation, post-position, deferred-vertex, visibility-stream,
// control-list, immediate, tessellated-in-memory, untiled, mesh-shader-ring, mesh-shader-compact, mesh-shader-references.
// Triangles without patches are drawn by tessellated-in-memory as by deferred-vertex, by untiled as by visibility-stream.
using ByScheme = std::array<std::uint64_t, kSchemeCount>;

ByScheme cycles(const gpu::GpuConfiguration& gpu, const scene::Capture& capture) {
  const BaselineSet set = timed(gpu, capture);
  ByScheme out{};
  for (std::size_t s = 0; s < kSchemeCount; ++s) out[s] = set.schemes[s].cycles;
  return out;
}

gpu::GpuConfiguration slow(Event event, double clocks) {
  gpu::GpuConfiguration gpu = endless();
  gpu.rates[event] = 1 / clocks;
  return gpu;
}

// Where nothing takes time a frame still takes a part of a clock, which counts as a whole one.
constexpr std::uint64_t kNone = 1;

// 84 triangles without a common vertex are four clusters or blocks of 21, as each holds 64 vertices.
constexpr std::uint32_t kMany = 84;

TEST(SchemeWork, TrianglesAreSetUpWhereTheyAreBinned) {
  const gpu::GpuConfiguration gpu = slow(Event::kTriangles, 64);
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{kNone, kNone, 64, 64, 64, 64, 64, kNone, 64, 64, 64, 64, 64}));
  constexpr std::uint64_t kAll = 84 * 64;
  EXPECT_EQ(cycles(gpu, triangles(kMany)),
            (ByScheme{kNone, kNone, kAll, kAll, kAll, kAll, kAll, kNone, kAll, kAll, kAll, kAll, kAll}));
}

// A cell and the leaf that holds it; drawing at once sets up the triangle in the same unit.
TEST(SchemeWork, EveryTileBuildsTheMachinesOwnBoxes) {
  EXPECT_EQ(cycles(slow(Event::kBoxes, 64), triangles(1)),
            (ByScheme{128, 128, 128, 128, 128, 128, 128, 192, 128, 128, 128, 128, 128}));
}

// Some schemes shade all of the three vertices once. The others shade positions before they make lists, and shade
// whole vertices when they draw. Mesh shaders output whole vertices; mesh shaders that run again in tiles shade
// twice.
TEST(SchemeWork, PositionPassesShadeVerticesTwice) {
  const gpu::GpuConfiguration gpu = slow(Event::kVertices, 10);
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{30, 30, 30, 60, 60, 60, 60, 30, 60, 60, 30, 30, 60}));
  EXPECT_EQ(cycles(gpu, triangles(kMany)),
            (ByScheme{2520, 2520, 2520, 5040, 5040, 5040, 5040, 2520, 5040, 5040, 2520, 2520, 5040}));
}

// An entry for each cluster or block; one run of visible triangles; one for each triangle. The last two are decoded in
// set-up, so that no core looks their references up.
TEST(SchemeWork, ListsAreBinnedAndFetchedEntryByEntry) {
  EXPECT_EQ(cycles(slow(Event::kBinnedEntries, 10), triangles(1)),
            (ByScheme{10, 10, 10, 10, 10, 10, 10, kNone, 10, 10, 10, 10, 10}));
  EXPECT_EQ(cycles(slow(Event::kFetchedEntries, 10), triangles(1)),
            (ByScheme{10, 10, 10, 10, 10, kNone, kNone, kNone, 10, kNone, 10, 10, 10}));
  EXPECT_EQ(cycles(slow(Event::kBinnedEntries, 10), triangles(kMany)),
            (ByScheme{40, 40, 40, 40, 40, 10, 840, kNone, 40, 10, 40, 40, 40}));
  EXPECT_EQ(cycles(slow(Event::kFetchedEntries, 10), triangles(kMany)),
            (ByScheme{40, 40, 40, 40, 40, kNone, kNone, kNone, 40, kNone, 40, 40, 40}));
}

// A warp of 32 lanes takes 100 clocks. All machines pack the invocations of a draw, whichever cluster they are of.
TEST(SchemeWork, TilesShadeTheWarpsOfTheMachine) {
  gpu::GpuConfiguration gpu = endless();
  gpu.shader.operations = 100;
  gpu.shader.lanes = 32;
  // Before, task shaders test the bounds that the front end computes for others, 128 instructions each on 32 lanes; and a
  // shader copies three vertices from the ring, 8 each.
  const std::uint64_t bounds = timed(gpu, triangles(1))[SchemeId::kDeferredVertex].bounding_operations,
                      tests = bounds * 128 / 32;
  EXPECT_EQ(cycles(gpu, triangles(1)),
            (ByScheme{100, 100, 100, 100, 100, 100, 100, 100, 100, 100, 100 + tests + 1, 100 + tests, 100 + tests}));
  const BaselineSet many = timed(gpu, triangles(kMany));
  ASSERT_EQ(many[SchemeId::kTessera].pixel_shader_invocations, 324u) << "81 of each cluster";
  const std::uint64_t of_many = many[SchemeId::kDeferredVertex].bounding_operations * 4;
  EXPECT_EQ(cycles(gpu, triangles(kMany)), (ByScheme{1100, 1100, 1100, 1100, 1100, 1100, 1100, 1100, 1100, 1100,
                                                     1100 + of_many + 63, 1100 + of_many, 1100 + of_many}))
      << "of 252 vertices";
  // Draws share no warp: four take 3 each.
  const ByScheme split = cycles(gpu, triangles(kMany, false, 4));
  for (const SchemeId scheme : {SchemeId::kTessera, SchemeId::kPostTessellation, SchemeId::kImmediate})
    EXPECT_EQ(split[static_cast<std::size_t>(scheme)], 1200u) << kSchemes[static_cast<std::size_t>(scheme)].name;
}

// A memory of a byte a clock never rests: all that a scheme counts passes it once.
TEST(SchemeWork, EveryByteTakesItsClock) {
  gpu::GpuConfiguration gpu = endless();
  gpu.set_bytes_per_clk(1);
  gpu.frame_buffer.compression = tilecore::FrameBufferCompression::kNone;
  for (const bool textured : {false, true})
    for (const std::uint32_t count : {1u, kMany}) {
      const BaselineSet set = timed(gpu, triangles(count, textured));
      for (std::size_t s = 0; s < kSchemeCount; ++s)
        EXPECT_EQ(set.schemes[s].cycles, set.schemes[s].dram_bytes + set.schemes[s].texture_bytes)
            << s << ' ' << count << ' ' << textured;
      EXPECT_GT(set[SchemeId::kPostTessellation].dram_bytes, 32u * 32u * 4u) << "the frame and more";
    }
}

// Reads that wait for each other take one latency each. The machine waits for the patch record, the list, the
// sub-patch record and its lines. Schemes with lists wait for the patch, and then for the list with its data, which
// is one stream; schemes that draw at once wait for the patch alone. A texture line that misses the caches adds one
// latency to every scheme.
TEST(SchemeWork, AMissedLineTakesALatency) {
  gpu::GpuConfiguration gpu = endless();
  gpu.set_latency_clk(1000);
  EXPECT_EQ(cycles(gpu, triangles(1)),
            (ByScheme{4000, 4000, 2000, 2000, 2000, 2000, 2000, 1000, 2000, 2000, 2000, 2000, 2000}));
  EXPECT_EQ(cycles(gpu, triangles(1, true)),
            (ByScheme{5000, 5000, 3000, 3000, 3000, 3000, 3000, 2000, 3000, 3000, 3000, 3000, 3000}));
}

// A patch that faces the camera and reaches beyond the frame: 19x19 cells, of which the outermost are outside.
scene::Capture patch() {
  scene::Capture capture;
  scene::Material material;
  material.unlit = true;
  test::add_node(capture, test::patches(test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}),
                                        test::add_material(capture, material)));
  test::add_camera(capture, {0, 0, 2});
  return capture;
}

BaselineSet timed_patch(const gpu::GpuConfiguration& gpu) {
  gpu::RunSettings settings;
  settings.tessellation.target_edge_pixels = 2;
  return timed(gpu, patch(), settings);
}

// A block of the compute tessellator: 8 bytes for each of 400 points, 12 for each of 722 triangles. Mesh shaders cut the
// patch into 3x3 parts with 7, 7 and 5 cells a side, so 22x22 vertices: four of 64 vertices and 98 triangles, four of 48
// and 70, one of 36 and 50. They have no attributes.
TEST(SchemeWork, APatchTakesTheBytesOfItsFormats) {
  const BaselineSet set = timed_patch(endless());
  const BaselineCounters &deferred = set[SchemeId::kDeferredVertex], &in_memory = set[SchemeId::kTessellatedInMemory],
                         &ring = set[SchemeId::kMeshShaderRing], &compact = set[SchemeId::kMeshShaderCompact],
                         &references = set[SchemeId::kMeshShaderReferences];
  EXPECT_EQ(deferred.position_evaluations, 20u * 20);
  EXPECT_EQ(in_memory.queue_bytes_written, deferred.queue_bytes_written + 400 * 8 + 722 * 12);
  EXPECT_EQ(in_memory.domain_evaluations, 18u * 18) << "vertices of 17x17 cells";
  // Nine references of 2 bytes for whole parts; eight lose an edge of cells, by masks of 13, 9 and 7 bytes or less.
  const std::uint64_t lists = ring.queue_bytes_written - 9 * (64 * 16 + 124 * 16);
  EXPECT_LE(lists, 1u + 8 + 1 + 2 * 9 + 4 * 13 + 4 * 9 + 7 + 4 * 4);
  EXPECT_EQ(compact.queue_bytes_written,
            lists + 4 * (4 + 64 * 16 + 98 * 3 + 2) + 4 * (4 + 48 * 16 + 70 * 3 + 2) + (4 + 36 * 16 + 50 * 3 + 2));
  // A byte of bits, a cursor, nine references, their end; chunks of 32 and 64 bytes leave room for a link of 4.
  EXPECT_EQ(references.queue_bytes_written, 1u + 8 + 9 * 24 + 1 + 4 * 4);
  for (const BaselineCounters* mesh : {&ring, &compact}) {
    EXPECT_EQ(mesh->domain_evaluations, 22u * 22);
    EXPECT_EQ(mesh->frame_bytes_read, 64u) << "a pyramid of 16 + 4 + 1 depths, in bursts";
  }
  EXPECT_EQ(references.position_evaluations, 22u * 22);
  EXPECT_EQ(references.domain_evaluations, 20u * 20) << "tiles shade whole meshlets, each of their vertices once";
}

// On 32 lanes: 64 instructions for the patch, 24 for a point, 18 for a triangle; 128 to test the patch, 1028 to bound and
// test each part; 8 to copy a vertex from the ring.
TEST(SchemeWork, ComputeAndTaskShadersTakeTheLanes) {
  gpu::GpuConfiguration gpu = endless();
  gpu.shader.lanes = 32;
  const auto clocks = [](std::uint64_t instructions) { return (instructions + 31) / 32; };
  const std::uint64_t points = 64 + 400 * 24 + 722 * 18, tests = 128 + 9 * 1028;
  ByScheme expected;
  expected.fill(kNone);
  const auto of = [&](SchemeId s) -> std::uint64_t& { return expected[static_cast<std::size_t>(s)]; };
  of(SchemeId::kTessellatedInMemory) = clocks(points);
  of(SchemeId::kMeshShaderRing) = clocks(tests + 484 * 8);
  of(SchemeId::kMeshShaderCompact) = of(SchemeId::kMeshShaderReferences) = clocks(tests);
  const BaselineSet set = timed_patch(gpu);
  for (std::size_t s = 0; s < kSchemeCount; ++s) EXPECT_EQ(set.schemes[s].cycles, expected[s]) << kSchemes[s].name;
  // The failing twin: twice the lanes take half as long.
  gpu.shader.lanes = 64;
  EXPECT_EQ(timed_patch(gpu)[SchemeId::kTessellatedInMemory].cycles, (points + 63) / 64);
}

}  // namespace
}  // namespace tessera::baselines::scheme_work_test
