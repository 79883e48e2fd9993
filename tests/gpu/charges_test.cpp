// The frame is charged for its use of the emulated units (gpu/work_recorder.h records it): each test needs more of
// one resource and pays for it. Most tests are twins: the same scene without the need pays nothing.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "memory/ledger.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"

namespace tessera::gpu::charges_test {
namespace {

using hardware::Event;
using memory::Purpose;
using memory::Unit;

std::uint64_t charged(const FrameResult& r, Event event) {
  std::uint64_t sum = 0;
  for (const timing::WorkRound& round : r.model->record.work.rounds)
    for (const timing::TileWork& tile : round.tiles) sum += tile.events[event];
  return sum;
}

constexpr int kSide = 96;
constexpr const char* kEvaluated = "shading.surface=evaluated";
constexpr std::uint32_t kPoints = 24;  // along a side of the mesh

scene::Primitive grid_mesh(int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j < kPoints; ++j)
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      positions.emplace_back(static_cast<float>(i) / (kPoints - 1) - 0.5f, static_cast<float>(j) / (kPoints - 1) - 0.5f,
                             0.0f);
      const std::uint32_t a = j * kPoints + i;
      if (i + 1 < kPoints && j + 1 < kPoints)
        indices.insert(indices.end(), {a, a + 1, a + kPoints + 1, a, a + kPoints + 1, a + kPoints});
    }
  return test::triangles(positions, indices, material);
}

scene::Primitive textured_patch() {
  scene::Primitive patch = test::patches(test::flat_patch({-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}));
  patch.vertices.texcoords = {{}};
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      patch.vertices.texcoords[0].emplace_back(static_cast<float>(i) / 3, static_cast<float>(j) / 3);
  return patch;
}

std::shared_ptr<const shaders::Texture> white() {
  Image8 image(1, 1, 4);
  image.values = {255, 255, 255, 255};
  return std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
}

scene::Capture seen(scene::Primitive primitive, const scene::Material& material, double distance = 1.5) {
  scene::Capture capture;
  primitive.material = test::add_material(capture, material);
  test::add_node(capture, std::move(primitive));
  test::add_camera(capture, {0, 0, distance});
  return capture;
}

FrameResult rendered(const scene::Capture& capture, std::initializer_list<const char*> settings = {}) {
  GpuConfiguration gpu;
  RunSettings run;
  for (const char* setting : settings) apply_setting(setting, run, gpu);
  return Device(capture, gpu, run, {kSide, kSide, {0, 0, kSide, kSide}}).render(0);
}

// Records that tile cores read, by lines that no tile reads twice.
std::uint64_t records_read(const scene::Capture& capture) {
  const memory::Ledger ledger = rendered(capture, {"l2.bytes=16777216"}).counters.ledger;
  return ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes +
         ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;
}

TEST(Charges, AnAttributeMoreOfAMeshIsMoreBytes) {
  scene::Material material;
  scene::Primitive mesh = grid_mesh(scene::kNone);
  const std::uint64_t plain = records_read(seen(mesh, material));
  EXPECT_GT(plain, 0u) << "positions and cells";
  mesh.vertices.normals.assign(mesh.vertices.count(), Vec3(0, 0, 1));
  const std::uint64_t normals = records_read(seen(mesh, material));
  EXPECT_GE(normals, plain + 4 * mesh.vertices.count());
  mesh.vertices.texcoords = {std::vector<Vec2>(mesh.vertices.count(), Vec2(0.5f))};
  EXPECT_EQ(records_read(seen(mesh, material)), normals) << "that no texture reads";
  material.base_color_texture.texture = white();
  const std::uint64_t textured = records_read(seen(mesh, material));
  EXPECT_GE(textured, normals + 8 * mesh.vertices.count());
  mesh.vertices.texcoords.push_back(mesh.vertices.texcoords[0]);
  material.emissive_texture.texture = white();
  EXPECT_EQ(records_read(seen(mesh, material)), textured) << "of the same set";
  material.emissive_texture.texcoord = 1;
  const std::uint64_t two_sets = records_read(seen(mesh, material));
  EXPECT_GE(two_sets, textured + 8 * mesh.vertices.count());
  mesh.vertices.colors.assign(mesh.vertices.count(), Vec4(1.0f));
  EXPECT_GE(records_read(seen(mesh, material)), two_sets + 4 * mesh.vertices.count());
}

TEST(Charges, AnAttributeMoreOfAPatchIsMoreBytes) {
  scene::Material material;
  std::vector<Vec3> points;
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) {
      const std::vector<Vec3> patch = test::flat_patch(
          {static_cast<float>(i) / 8 - 0.5f, static_cast<float>(j) / 8 - 0.5f, 0}, {0.125f, 0, 0}, {0, 0.125f, 0});
      points.insert(points.end(), patch.begin(), patch.end());
    }
  scene::Primitive patches = test::patches(points);
  const std::uint64_t plain = records_read(seen(patches, material));
  EXPECT_GE(plain, 64u * (32 + 192)) << "the pixel shader evaluates control points";
  patches.vertices.colors.assign(points.size(), Vec4(1.0f));
  EXPECT_GE(records_read(seen(patches, material)), plain + 64 * 4 * 4 - 64);
}

TEST(Charges, AnInvocationThatEvaluatesADisplacedPatchLooksHeightsUp) {
  const scene::Primitive patch = textured_patch();
  scene::Material plain, displaced;
  displaced.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.01f, 0);
  const FrameResult flat = rendered(seen(patch, plain), {kEvaluated}),
                    high = rendered(seen(patch, displaced), {kEvaluated});
  EXPECT_EQ(flat.counters.shading.height_lookups, 0u);
  EXPECT_GT(high.counters.shading.surface_evaluations, 0u);
  EXPECT_EQ(high.counters.shading.height_lookups, 8 * high.counters.shading.surface_evaluations);
  EXPECT_EQ(charged(high, Event::kHeightTexels), high.counters.shading.height_lookups);
  EXPECT_GT(high.model->energy.by_unit_nj.at("texture"), flat.model->energy.by_unit_nj.at("texture"));
}

TEST(Charges, APatchThatPixelsEvaluateAgainTakesOperations) {
  const scene::Material material;
  scene::Primitive patch = test::patches(test::flat_patch({-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}));
  const char *const constant = "shader.costs=constant", *const unit = "tessellator.domain_shading=unit",
                    *const nothing_behind = "shader.background_operations=0";
  const FrameResult of_patch = rendered(seen(patch, material), {kEvaluated, constant, unit, nothing_behind}),
                    of_mesh = rendered(seen(grid_mesh(scene::kNone), material));
  EXPECT_GT(of_patch.counters.shading.pixel_shader_invocations, 0u);
  EXPECT_EQ(of_patch.counters.shading.surface_evaluations, of_patch.counters.shading.pixel_shader_invocations);
  EXPECT_EQ(of_patch.counters.shading.surface_warps, of_patch.counters.shading.warps);
  EXPECT_EQ(of_mesh.counters.shading.surface_evaluations, 0u);
  const FrameResult free =
      rendered(seen(patch, material), {kEvaluated, constant, unit, nothing_behind, "shader.surface_operations=0"});
  const auto shader = [](const FrameResult& r) {
    return r.model->timing.busy[static_cast<std::size_t>(hardware::Stage::kShader)];
  };
  EXPECT_NEAR(shader(of_patch) / shader(free), (160.0 + 130) / 160, 1e-9);
  EXPECT_GT(of_patch.model->energy.by_unit_nj.at("shader"), free.model->energy.by_unit_nj.at("shader"));
}

TEST(Charges, BlendedLayersTakeTileMemory) {
  scene::Material clear;
  clear.alpha_mode = scene::AlphaMode::kBlend;
  clear.base_color.a = 0.5f;
  const timing::FrameWork opaque = rendered(seen(grid_mesh(scene::kNone), {})).model->record.work,
                          blended = rendered(seen(grid_mesh(scene::kNone), clear)).model->record.work;
  EXPECT_EQ(blended.tile_state_bytes, opaque.tile_state_bytes) << "a tile takes its own memory, not another tile's";
  const auto most = [](const timing::FrameWork& work) {
    std::uint64_t bytes = 0;
    for (const timing::TileWork& tile : work.rounds.front().tiles) bytes = std::max(bytes, tile.extra_bytes);
    return bytes;
  };
  EXPECT_EQ(most(blended) - most(opaque), 32u * 32 * 4 * 16)
      << "a layer for each sample of the tile that is all covered";
}

TEST(Charges, CompactionAndCoarseDepthTakeTime) {
  scene::Capture capture = seen(grid_mesh(scene::kNone), {}, 0.6);  // all samples see it
  test::add_node(capture, grid_mesh(scene::kNone), {0, 0, -0.05});  // and the grid behind it tests coarse depth
  const FrameResult usual = rendered(capture);
  const auto busy = [](const FrameResult& r, hardware::Stage stage) {
    return r.model->timing.busy[static_cast<std::size_t>(stage)];
  };
  EXPECT_DOUBLE_EQ(busy(usual, hardware::Stage::kCompaction),
                   static_cast<double>(usual.counters.shading.samples_visible) / 32 / 4)
      << "32 samples a clock in four cores";
  EXPECT_DOUBLE_EQ(
      busy(usual, hardware::Stage::kCoarseDepth),
      static_cast<double>(usual.counters.tilecore.depth_blocks_updated + usual.counters.tilecore.depth_tests) / 4);
  EXPECT_GT(usual.counters.tilecore.depth_tests, 0u);
  EXPECT_GT(usual.counters.tilecore.depth_blocks_updated, 0u);
  EXPECT_GT(rendered(capture, {"tilecore.compaction_per_clk=0.1"}).model->timing.cycles, usual.model->timing.cycles);
  EXPECT_GT(rendered(capture, {"tilecore.depth_blocks_per_clk=0.001"}).model->timing.cycles,
            usual.model->timing.cycles);
  EXPECT_EQ(rendered(capture, {"tilecore.occlusion_culling=false"}).counters.tilecore.depth_blocks_updated, 0u)
      << "no unit asks for the farthest depth";
}

// ---- The environment behind everything ------------------------------------------------------------------------------

double shader_cycles(const FrameResult& r) {
  return r.model->timing.busy[static_cast<std::size_t>(hardware::Stage::kShader)];
}

// Clocks of lanes that warps of one kind take.
std::uint64_t clocks_of(const FrameResult& r, std::uint32_t kind) {
  std::uint64_t clocks = 0;
  for (const timing::WorkRound& round : r.model->record.work.rounds)
    for (const timing::TileItems& items : round.items)
      for (const timing::WarpItem& warp : items.warps)
        if (warp.kind == kind) clocks += std::uint64_t{warp.lanes} * warp.clocks;
  return clocks;
}

TEST(Charges, SamplesThatSeeTheEnvironmentAreComputed) {
  scene::Capture capture = seen(grid_mesh(scene::kNone), {});
  const FrameResult around = rendered(capture);
  const tilecore::ShadingCounters& c = around.counters.shading;
  EXPECT_EQ(c.background_samples + c.samples_visible, std::uint64_t{kSide} * kSide * 4);
  EXPECT_EQ(charged(around, Event::kBackgroundSamples), c.background_samples);
  EXPECT_EQ(charged(around, Event::kBackgroundLanes), c.background_warps * 32);
  EXPECT_EQ(charged(around, Event::kCompactedSamples), c.samples_visible + c.background_samples);
  EXPECT_EQ(clocks_of(around, timing::WarpItem::kBackground), c.background_samples * 46) << "as compiled";

  capture.settings.background = Vec3(0.5f);
  const FrameResult plain = rendered(capture);
  EXPECT_EQ(plain.counters.shading.background_samples, 0u) << "a colour is no computation";
  EXPECT_EQ(clocks_of(plain, timing::WarpItem::kBackground), 0u);
  EXPECT_GT(shader_cycles(around), shader_cycles(plain));
  EXPECT_GT(around.model->energy.by_unit_nj.at("shader"), plain.model->energy.by_unit_nj.at("shader"));

  capture.settings.background.reset();
  capture.settings.environment_kind = shaders::Surroundings::Kind::kUniform;
  EXPECT_EQ(rendered(capture).counters.shading.background_samples, 0u) << "nor is a uniform environment";
}

TEST(Charges, ATurningCameraTakesMoreOfTheEnvironment) {
  scene::Capture along = seen(grid_mesh(scene::kNone), {});
  along.settings.shutter_close = 1;
  scene::Capture turns = along;
  const int camera = static_cast<int>(along.nodes.size()) - 1;
  test::add_motion(along, camera, {0, 0.01, 0});
  test::add_turn(turns, camera, {0, 1, 0}, 0.05f);
  const FrameResult moved = rendered(along), turned = rendered(turns);
  EXPECT_EQ(clocks_of(moved, timing::WarpItem::kBackground), moved.counters.shading.background_samples * 46)
      << "a step sideways changes nothing that is infinitely far";
  EXPECT_EQ(clocks_of(turned, timing::WarpItem::kBackground), turned.counters.shading.background_samples * 64);
}

TEST(Charges, TheEnvironmentTakesTheSameTimeInBothModels) {
  const scene::Capture capture = seen(grid_mesh(scene::kNone), {});
  const char *const constant = "shader.costs=constant", *const unit = "tessellator.domain_shading=unit",
                    *const some = "shader.background_operations=100";
  const FrameResult without = rendered(capture, {constant, unit, "shader.background_operations=0"}),
                    with = rendered(capture, {constant, unit, some}),
                    coarse = rendered(capture, {"machine.timing=phases", unit, some});
  const double cycles = static_cast<double>(with.counters.shading.background_warps) * 32 * 100 / 32 / 4;
  EXPECT_DOUBLE_EQ(shader_cycles(with) - shader_cycles(without), cycles) << "in four cores of 32 lanes";
  EXPECT_NEAR(shader_cycles(coarse) / shader_cycles(with), 1, 1e-9);
}

// ---- Vertices that pixels interpolate -------------------------------------------------------------------------------

TEST(Charges, VerticesThatPixelsInterpolateAreEvaluatedWrittenAndRead) {
  const scene::Primitive patch = test::patches(test::flat_patch({-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}));
  const FrameResult now = rendered(seen(patch, {}), {"shading.surface=interpolated"}),
                    before = rendered(seen(patch, {}), {kEvaluated});
  const tilecore::ShadingCounters& c = now.counters.shading;
  EXPECT_EQ(before.counters.shading.vertex_outputs, 0u);
  EXPECT_EQ(c.surface_evaluations, 0u);
  EXPECT_EQ(c.pixel_shader_invocations, before.counters.shading.pixel_shader_invocations);
  EXPECT_GT(c.vertex_outputs, 0u);
  EXPECT_LE(c.vertex_outputs, now.counters.tessellation.domain_evaluations + 9u * 4 * kSide) << "shared by two tiles";
  constexpr std::uint64_t kBytes = 12 + 16 + 12;  // place, raster, normal
  EXPECT_EQ(c.vertex_output_bytes, (c.vertex_outputs + 3 * c.pixel_shader_invocations) * kBytes);
  EXPECT_EQ(charged(now, Event::kVertexOutputs), c.vertex_outputs);
  EXPECT_EQ(charged(now, Event::kVertexOutputLanes), c.vertex_output_warps * 32);
  const std::uint64_t table = now.counters.tilecore.triangle_table_bytes;
  EXPECT_EQ(charged(now, Event::kTileBytes), c.vertex_output_bytes + table);
  EXPECT_EQ(clocks_of(now, timing::WarpItem::kVertices), c.vertex_outputs * 258) << "as compiled";
  EXPECT_EQ(clocks_of(now, timing::WarpItem::kEvaluating), 0u);
  std::uint64_t kept = 0;
  for (const timing::TileWork& tile : now.model->record.work.rounds.front().tiles) kept += tile.extra_bytes;
  EXPECT_EQ(kept + 16 * c.pixel_shader_invocations, c.vertex_outputs * kBytes + table) << "in the tile memory";
  EXPECT_LT(shader_cycles(now), shader_cycles(before));
  EXPECT_EQ(rendered(seen(grid_mesh(scene::kNone), {})).counters.shading.vertex_outputs, 0u)
      << "a mesh has its vertices";
}

TEST(Charges, PixelsOfProceduresTakeTheirOperationsAndTheGeometrysWhereTheyEvaluateIt) {
  scene::Capture capture;
  shaders::ShapeInput sphere;
  sphere.p = {0.5f, 0.5f, 0.5f};
  test::add_procedure(capture, shaders::ShapeId::kSphere, sphere, {0, 0, 0}, test::add_material(capture, {}));
  test::add_camera(capture, {0, 0, 2});
  const char* const patches = "procedures.path=tessellated";
  const FrameResult now = rendered(capture, {"shading.surface=interpolated", patches}),
                    before = rendered(capture, {kEvaluated, patches}), sampled = rendered(capture);
  using timing::WarpItem;
  const auto geometry = static_cast<std::uint64_t>([&] {
    const shaders::OperationCount count = shaders::count_geometry(shaders::ShapeId::kSphere, sphere);
    return count.total() + 3 * (count.divides + count.square_roots);
  }());
  const std::uint64_t pixels = now.counters.shading.pixel_shader_invocations;
  ASSERT_EQ(pixels, before.counters.shading.pixel_shader_invocations);
  EXPECT_EQ(clocks_of(now, WarpItem::kVertices), now.counters.shading.vertex_outputs * geometry);
  EXPECT_EQ(clocks_of(now, WarpItem::kEvaluating), 0u);
  EXPECT_EQ(clocks_of(before, WarpItem::kEvaluating), clocks_of(now, WarpItem::kPixels) + pixels * geometry);
  EXPECT_EQ(clocks_of(sampled, WarpItem::kEvaluating) / sampled.counters.shading.pixel_shader_invocations,
            clocks_of(before, WarpItem::kEvaluating) / pixels)
      << "samples keep parameters alone";
}

TEST(Charges, PlacesAtShutterOpenAreFoundWhereThingsMove) {
  scene::Capture still = seen(grid_mesh(scene::kNone), {});
  still.settings.shutter_close = 1;
  scene::Capture moving = still;
  test::add_motion(moving, 0, {0.05, 0, 0});
  const FrameResult rests = rendered(still), moves = rendered(moving);
  EXPECT_EQ(charged(rests, Event::kPlacesFound), 0u);
  EXPECT_EQ(charged(moves, Event::kPlacesFound), moves.counters.shading.samples_visible) << "one for each";
  const auto reads = [](const FrameResult& r) {
    return 16 * r.counters.shading.pixel_shader_invocations + 24 * r.counters.shading.places_found;
  };
  for (const FrameResult* r : {&rests, &moves}) {
    std::uint64_t kept = 0;
    for (const timing::TileWork& tile : r->model->record.work.rounds.front().tiles) kept += tile.extra_bytes;
    EXPECT_EQ(r->counters.tilecore.triangle_table_bytes, kept + reads(*r)) << "written once, read for each";
    EXPECT_EQ(charged(*r, Event::kTileBytes), r->counters.tilecore.triangle_table_bytes);
  }
  EXPECT_GT(moves.counters.tilecore.triangle_table_bytes - reads(moves),
            4 * (rests.counters.tilecore.triangle_table_bytes - reads(rests)))
      << "corners of leaves that move";
}

TEST(Charges, ATileOfMovingThingsTakesNoMoreForItsSamples) {
  scene::Capture still = seen(grid_mesh(scene::kNone), {});
  still.settings.shutter_close = 1;
  scene::Capture moving = still;
  test::add_motion(moving, 0, {0.05, 0, 0});
  const auto state_bytes = [](const FrameResult& r) { return r.model->record.work.tile_state_bytes; };
  EXPECT_EQ(state_bytes(rendered(still)), state_bytes(rendered(moving)));
  EXPECT_EQ(state_bytes(rendered(still, {"tilecore.weight_bits=32"})) - state_bytes(rendered(still)), 4u * 32 * 32 * 4);
}

TEST(Charges, HeightsAreLookedUpForVerticesThatPixelsInterpolate) {
  const scene::Primitive patch = textured_patch();
  scene::Material displaced;
  displaced.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.01f, 0);
  const FrameResult r = rendered(seen(patch, displaced), {"shading.surface=interpolated"});
  EXPECT_GT(r.counters.shading.vertex_outputs, 0u);
  EXPECT_EQ(r.counters.shading.height_lookups, 8 * r.counters.shading.vertex_outputs);
  EXPECT_EQ(charged(r, Event::kHeightTexels), r.counters.shading.height_lookups);
}

// ---- Compressed textures --------------------------------------------------------------------------------------------

TEST(Charges, LookupsInBlocksAreDecoded) {
  scene::Primitive mesh = grid_mesh(scene::kNone);
  mesh.vertices.texcoords = {{}};
  for (std::size_t k = 0; k < mesh.vertices.count(); ++k)
    mesh.vertices.texcoords[0].emplace_back(mesh.vertices.positions[k].x + 0.5f, mesh.vertices.positions[k].y + 0.5f);
  const auto textured = [&](shaders::TexelBlocks blocks) {
    scene::Material material;
    material.base_color_texture.texture = std::make_shared<const shaders::Texture>(
        std::vector<shaders::Texture::Level>{{8, 8, std::vector<std::uint8_t>(8 * 8 * 4, 255)}},
        shaders::ColorSpace::kLinear, blocks);
    return rendered(seen(mesh, material));
  };
  const FrameResult plain = textured({1, 4}), blocks = textured({4, 16});
  EXPECT_GT(plain.counters.texture.texels, 0u);
  EXPECT_EQ(blocks.counters.texture.texels, plain.counters.texture.texels);
  EXPECT_EQ(plain.counters.texture.texels_decoded, 0u);
  EXPECT_EQ(blocks.counters.texture.texels_decoded, blocks.counters.texture.texels);
  EXPECT_EQ(charged(blocks, Event::kDecodedTexels), blocks.counters.texture.texels_decoded);
  EXPECT_GT(blocks.model->energy.by_unit_nj.at("texture"), plain.model->energy.by_unit_nj.at("texture"))
      << "fewer lines, but each lookup is decoded";
}

}  // namespace
}  // namespace tessera::gpu::charges_test
