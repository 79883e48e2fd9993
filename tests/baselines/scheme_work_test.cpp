// Work of schemes (baselines/scheme_work.h) on machines of which one thing takes time: cycles known by hand.
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::baselines::scheme_work_test {
namespace {

using hardware::Event;

gpu::GpuConfiguration endless() { return test::endless_machine<gpu::GpuConfiguration>(); }

// Triangles of a few pixels side by side, which share no vertex, in a frame of one tile; with a texture of one line.
scene::Capture triangles(std::uint32_t count, bool textured = false) {
  scene::Capture capture;
  scene::Material material;
  material.unlit = true;
  if (textured) {
    Image8 texel(1, 1, 4);
    texel.values = {255, 255, 255, 255};
    material.base_color_texture.texture =
        std::make_shared<shaders::Texture>(DecodedImage{std::move(texel)}, shaders::ColorSpace::kLinear);
  }
  std::vector<Vec3> corners;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t t = 0; t < count; ++t) {
    const float x = count == 1 ? 0 : static_cast<float>(t % 12) * 0.14f - 0.77f,
                y = count == 1 ? 0 : static_cast<float>(t / 12) * 0.2f - 0.7f;
    for (const Vec2& corner : {Vec2(-0.06f, -0.09f), Vec2(0.06f, -0.09f), Vec2(0, 0.09f)}) {
      indices.push_back(static_cast<std::uint32_t>(corners.size()));
      corners.emplace_back(x + corner.x, y + corner.y, 0.0f);
    }
  }
  scene::Primitive mesh = test::triangles(corners, indices, test::add_material(capture, material));
  mesh.vertices.texcoords = {std::vector<Vec2>(corners.size(), Vec2(0.5f))};
  test::add_node(capture, std::move(mesh));
  test::add_camera(capture, {0, 0, 2});
  return capture;
}

BaselineSet timed(const gpu::GpuConfiguration& gpu, const scene::Capture& capture) {
  gpu::RunSettings settings;
  settings.sampling.samples_per_pixel = 1;
  gpu::Device device(capture, gpu, settings, {32, 32, {0, 0, 32, 32}});
  BaselineObserver schemes;
  device.set_observer(&schemes);
  device.render(0);
  return schemes.last();
}

// By scheme, in their order: tessera, patch-whole, post-tessellation, post-position, deferred-vertex, visibility-stream,
// control-list, immediate.
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
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{kNone, kNone, 64, 64, 64, 64, 64, kNone}));
  EXPECT_EQ(cycles(gpu, triangles(kMany)),
            (ByScheme{kNone, kNone, 84 * 64, 84 * 64, 84 * 64, 84 * 64, 84 * 64, kNone}));
}

// A cell and the leaf that holds it; drawing at once sets up the triangle in the same unit.
TEST(SchemeWork, EveryTileBuildsTheMachinesOwnBoxes) {
  EXPECT_EQ(cycles(slow(Event::kBoxes, 64), triangles(1)), (ByScheme{128, 128, 128, 128, 128, 128, 128, 192}));
}

// Some schemes shade the three vertices once, whole. The others shade their positions before they make lists, and shade
// vertices whole when they draw them.
TEST(SchemeWork, PositionPassesShadeVerticesTwice) {
  const gpu::GpuConfiguration gpu = slow(Event::kVertices, 10);
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{30, 30, 30, 60, 60, 60, 60, 30}));
  EXPECT_EQ(cycles(gpu, triangles(kMany)), (ByScheme{2520, 2520, 2520, 5040, 5040, 5040, 5040, 2520}));
}

// An entry for each cluster or block; one run of visible triangles; one for each triangle. The last two are decoded in
// set-up, so that no core looks their references up.
TEST(SchemeWork, ListsAreBinnedAndFetchedEntryByEntry) {
  EXPECT_EQ(cycles(slow(Event::kBinnedEntries, 10), triangles(1)), (ByScheme{10, 10, 10, 10, 10, 10, 10, kNone}));
  EXPECT_EQ(cycles(slow(Event::kFetchedEntries, 10), triangles(1)),
            (ByScheme{10, 10, 10, 10, 10, kNone, kNone, kNone}));
  EXPECT_EQ(cycles(slow(Event::kBinnedEntries, 10), triangles(kMany)), (ByScheme{40, 40, 40, 40, 40, 10, 840, kNone}));
  EXPECT_EQ(cycles(slow(Event::kFetchedEntries, 10), triangles(kMany)),
            (ByScheme{40, 40, 40, 40, 40, kNone, kNone, kNone}));
}

// A warp of 32 lanes takes 100 clocks. A tile packs its invocations, whatever drew them; at once each cluster has its own.
TEST(SchemeWork, TilesShadeTheWarpsOfTheMachine) {
  gpu::GpuConfiguration gpu = endless();
  gpu.shader.operations = 100;
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{100, 100, 100, 100, 100, 100, 100, 100}));
  const BaselineSet many = timed(gpu, triangles(kMany));
  ASSERT_EQ(many[SchemeId::kTessera].pixel_shader_invocations, 324u) << "81 of each cluster";
  EXPECT_EQ(cycles(gpu, triangles(kMany)), (ByScheme{1100, 1100, 1100, 1100, 1100, 1100, 1100, 1200}));
}

// A memory of a byte a clock never rests: all that a scheme counts passes it once.
TEST(SchemeWork, EveryByteTakesItsClock) {
  gpu::GpuConfiguration gpu = endless();
  gpu.set_bytes_per_clk(1);
  for (const bool textured : {false, true})
    for (const std::uint32_t count : {1u, kMany}) {
      const BaselineSet set = timed(gpu, triangles(count, textured));
      for (std::size_t s = 0; s < kSchemeCount; ++s)
        EXPECT_EQ(set.schemes[s].cycles, set.schemes[s].dram_bytes + set.schemes[s].texture_bytes)
            << s << ' ' << count << ' ' << textured;
      EXPECT_GT(set[SchemeId::kPostTessellation].dram_bytes, 32u * 32u * 8u) << "the frame and more";
    }
}

// Reads that wait for each other take a latency each: the machine's patch record, list, sub-patch record and its lines;
// theirs of the patch and of list and what it names, which is one stream; at once that of the patch alone. A texture's line
// that the caches miss is one more for all.
TEST(SchemeWork, AMissedLineTakesALatency) {
  gpu::GpuConfiguration gpu = endless();
  gpu.set_latency_clk(1000);
  EXPECT_EQ(cycles(gpu, triangles(1)), (ByScheme{4000, 4000, 2000, 2000, 2000, 2000, 2000, 1000}));
  EXPECT_EQ(cycles(gpu, triangles(1, true)), (ByScheme{5000, 5000, 3000, 3000, 3000, 3000, 3000, 2000}));
}

}  // namespace
}  // namespace tessera::baselines::scheme_work_test
