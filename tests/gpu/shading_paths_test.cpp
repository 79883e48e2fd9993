// Shading paths (gpu/shading_paths.cpp; tilecore/shading/: shading_settings.cpp, deferred_shader.cpp, gbuffer_shading.cpp): whichever way surfaces come to be shaded, images
// keep their bits; what each path keeps, moves and shades is charged.
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>

#include "base/image_metrics.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/tile_memory.h"
#include "hardware/tile_rules.h"
#include "scene/capture_reader.h"
#include "tests/support/displayed_image.h"
#include "tests/support/lit_room.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/procedures.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::gpu::shading_paths_test {
namespace {

using memory::Purpose;
using memory::Unit;
using scene::Capture;
using shaders::Light;
using test::add_lamp;
using test::lamp;
using test::Room;
using Keys = std::vector<std::string>;

constexpr int kWidth = 112, kHeight = 80;
const std::array<std::string, 3> kOtherPaths = {"prepass", "gbuffer", "gbuffer_external"};

FrameResult frame_of(const Capture& capture, Keys keys, const std::string& path,
                     IntRect region = {0, 0, kWidth, kHeight}, int frame = 0, int width = kWidth,
                     int height = kHeight) {
  RunSettings settings;
  GpuConfiguration gpu;
  keys.push_back("shading.path=" + path);
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  return Device(capture, gpu, settings, {width, height, region}).render(frame);
}

bool same_bits(const FrameResult& a, const FrameResult& b) {
  const std::vector<float>&left = a.targets.color.values, &right = b.targets.color.values;
  return left.size() == right.size() && std::memcmp(left.data(), right.data(), left.size() * sizeof(float)) == 0;
}

// ---- Same bits ---------------------------------------------------------------------------------------------------

struct Case {
  const char* name;
  std::function<void(Room&)> change = {};
  Keys keys = {};
  std::vector<std::string> paths = {kOtherPaths.begin(), kOtherPaths.end()};
  IntRect region = {0, 0, kWidth, kHeight};
};

void open_shutter(Room& room) { room.capture.settings.shutter_close = 1; }

void move_balls(Room& room) {
  open_shutter(room);
  test::add_motion(room.capture, room.ball, {1.2, 0.3, -0.5});
  test::add_motion(room.capture, room.shiny, {0.5, 0, 0.4});
}

// Every sample is stored as eight bits a channel, and a copy resolves them.
void store_samples(Room& room) {
  scene::PassGraph graph;
  graph.attachments.emplace_back().name = "lit";
  scene::Pass draw, copy;
  draw.name = "draw", copy.name = "copy";
  draw.subpasses = {{scene::DrawFilter::kAll, scene::PassShader::kForward, {}, {"lit"}, {}}};
  draw.store = {{"lit", scene::StoreAction::kStore}};
  copy.subpasses = {{scene::DrawFilter::kNothing, scene::PassShader::kCopy, {}, {"frame"}, {"lit"}}};
  graph.passes = {draw, copy};
  room.capture.settings.graph = graph;
}

void cast_shadows(Room& room) {
  for (const int light : {0, 1, 10}) room.capture.settings.shadows.push_back({.light = light, .size = 64});
}

class PathsKeepBits : public testing::TestWithParam<Case> {};

TEST_P(PathsKeepBits, OfAllPixels) {  // GB1
  const Case& param = GetParam();
  Room room;
  if (param.change) param.change(room);
  const FrameResult expected = frame_of(room.capture, param.keys, "visibility", param.region);
  for (const std::string& path : param.paths) {
    const FrameResult found = frame_of(room.capture, param.keys, path, param.region);
    EXPECT_TRUE(same_bits(found, expected)) << path;
    const tilecore::GbufferCounters& c = found.counters.gbuffer;
    EXPECT_EQ(found.counters.binner.partial_renders > 0, std::string_view(param.name).starts_with("partial"));
    EXPECT_EQ(c.spilled_bytes > 0, std::string_view(param.name) == "spilling_tiles") << path;
    EXPECT_EQ(found.counters.lights.lists > 0, expected.counters.lights.lists > 0) << path;
    EXPECT_EQ(c.filled > 0, path != "prepass") << path;
    EXPECT_LE(c.filled, found.counters.shading.pixel_shader_invocations) << path;
    EXPECT_EQ(found.counters.shading.pixel_shader_invocations, expected.counters.shading.pixel_shader_invocations);
  }
}

INSTANTIATE_TEST_SUITE_P(
    ShadingPaths, PathsKeepBits,
    testing::Values(
        Case{"still"}, Case{"all_lights", {}, {"shading.light_lists=off"}},
        Case{"region", {}, {}, {kOtherPaths.begin(), kOtherPaths.end()}, {24, 16, 90, 64}},
        Case{"one_sample", {}, {"sampling.samples_per_pixel=1"}},
        Case{"sixteen_samples", {}, {"sampling.samples_per_pixel=16"}}, Case{"balls_move", move_balls},
        Case{"lights_move",
             [](Room& room) {
               open_shutter(room);
               test::add_motion(room.capture, room.first_lamp, {1, 0.5, 0.7});
             }},
        Case{"camera_moves",
             [](Room& room) {
               open_shutter(room);
               test::add_motion(room.capture, room.camera, {0.3, 0.1, -0.8});
               test::add_turn(room.capture, room.camera, {0.1f, 1, 0}, 0.2f);
             }},
        Case{"curved_motion",
             [](Room& room) {
               move_balls(room);
               test::add_turn(room.capture, room.ball, {0, 0, 1}, 3.0f);
             },
             {"sampling.motion_segments=4"}},
        Case{"lens",
             [](Room& room) {
               room.capture.cameras[0].lens = {0.1f, 5.0f};
             }},
        Case{"lens_and_motion",
             [](Room& room) {
               move_balls(room);
               room.capture.cameras[0].lens = {0.1f, 4.0f};
             }},
        Case{"orthographic",
             [](Room& room) {
               room.capture.cameras[0].type = scene::Camera::Type::kOrthographic;
               room.capture.cameras[0].x_mag = 4, room.capture.cameras[0].y_mag = 3;
             }},
        Case{"shadows", cast_shadows}, Case{"shadows_of_all_lights", cast_shadows, {"shading.light_lists=off"}},
        Case{"shadows_move",
             [](Room& room) {
               move_balls(room);
               cast_shadows(room);
             },
             {"shadows.times=2"}},
        Case{"rate_of_samples", {}, {"shading.rate=sample"}}, Case{"quads", move_balls, {"shading.derivatives=quad"}},
        Case{"evaluated", move_balls, {"shading.surface=evaluated"}}, Case{"frames", {}, {"shading.surface=frame"}},
        Case{"half_attributes", {}, {"shading.attributes=half"}},
        Case{"desampled", {}, {"resolve.desampling=checkerboard"}, {"prepass", "gbuffer"}},
        Case{"desampled_by_content", move_balls, {"resolve.desampling=adaptive"}, {"prepass", "gbuffer"}},
        Case{"stored_samples", store_samples},
        Case{"stored_samples_that_move",
             [](Room& room) {
               move_balls(room);
               store_samples(room);
             }},
        Case{"partial_renders",
             {},
             {"parameter_buffer.bytes=4096", "tessellator.sub_patch_cells=4", "tile.width=16", "tile.height=16"}},
        Case{"partial_renders_of_moving_surfaces",
             move_balls,
             {"parameter_buffer.bytes=4096", "tessellator.sub_patch_cells=4", "tile.width=16", "tile.height=16"}},
        Case{"fitted_tiles", {}, {"tile.fit=true"}}, Case{"small_tiles", {}, {"tile.width=8", "tile.height=16"}},
        Case{"spilling_tiles", {}, {"tile.fit=true", "tilecore.memory_bytes=4096", "sampling.samples_per_pixel=8"}},
        Case{"two_eyes", {}, {"stereo.eye_separation=0.06"}}, Case{"no_items", {}, {"machine.timing=phases"}},
        Case{"masked",
             [](Room& room) {
               room.capture.materials[0].alpha_mode = scene::AlphaMode::kMask;
               room.capture.materials[0].alpha_cutoff = 0.5f;
             }},
        Case{"displaced",
             [](Room& room) {
               room.capture.materials[1].displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.2f, 0);
             }},
        Case{"transmission",
             [](Room& room) {
               scene::Material& m = room.capture.materials[4];
               m.transmission.factor = 0.8f;
               m.effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
             },
             {},
             {"gbuffer"}},
        Case{"no_numbers",
             [](Room& room) { room.capture.materials[1].emissive.y = std::numeric_limits<float>::quiet_NaN(); },
             {"frame_buffer.compression=none"}}),
    [](const auto& case_of) { return std::string(case_of.param.name); });

// The parts of a room in random places, with random lights, samples, motion and ways to shade.
TEST(ShadingPaths, RandomRoomsKeepTheirBits) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    Room room;
    if (random.coin()) open_shutter(room);
    for (const int node : {room.ball, room.shiny}) {
      room.capture.nodes[static_cast<std::size_t>(node)].transform.translation += DVec3(random.in_box(1.0f));
      if (random.coin()) test::add_motion(room.capture, node, DVec3(random.in_box(1.0f)));
    }
    if (random.coin()) cast_shadows(room);
    if (random.coin()) room.capture.cameras[0].lens = {random.uniform(0.01f, 0.1f), random.uniform(2.0f, 6.0f)};
    for (scene::Material& m : room.capture.materials)
      m.roughness = random.uniform(0, 1), m.metallic = random.uniform(0, 1);
    const std::array<const char*, 4> samples = {"1", "2", "4", "7"};
    const std::array<const char*, 3> rates = {"pixel", "primitive", "sample"}, lists = {"off", "ranged", "all"};
    const auto any = [&](const auto& of) {
      return of[static_cast<std::size_t>(random.integer(0, static_cast<int>(of.size()) - 1))];
    };
    const Keys keys = {std::string("sampling.samples_per_pixel=") + any(samples),
                       std::string("shading.rate=") + any(rates), std::string("shading.light_lists=") + any(lists),
                       random.coin() ? "tile.fit=true" : "tile.width=16"};
    const FrameResult expected = frame_of(room.capture, keys, "visibility");
    for (const std::string& path : kOtherPaths)
      EXPECT_TRUE(same_bits(frame_of(room.capture, keys, path), expected)) << "seed " << seed << ", " << path;
  }
}

// The twin: a G-buffer that rounds is seen in the bits.
TEST(ShadingPaths, ARoundedGbufferIsNoticed) {
  const Room room;
  const FrameResult expected = frame_of(room.capture, {}, "visibility");
  for (const char* path : {"gbuffer", "gbuffer_external"})
    EXPECT_FALSE(same_bits(frame_of(room.capture, {"gbuffer.layout=packed"}, path), expected)) << path;
}

TEST(ShadingPaths, ProceduresShadeForward) {
  Room room;
  scene::Material brass;
  const int material = test::add_material(room.capture, brass);
  Random random(3);
  test::add_procedure(room.capture, shaders::ShapeId{0}, test::random_shape(random, shaders::ShapeId{0}), {0, 0, -2},
                      material);
  const FrameResult expected = frame_of(room.capture, {}, "visibility");
  for (const std::string& path : kOtherPaths)
    EXPECT_TRUE(same_bits(frame_of(room.capture, {}, path), expected)) << path;
}

TEST(ShadingPaths, AFrameOfOnePixel) {
  const Room room;
  const IntRect whole{0, 0, 1, 1};
  const FrameResult expected = frame_of(room.capture, {}, "visibility", whole, 0, 1, 1);
  for (const std::string& path : kOtherPaths)
    EXPECT_TRUE(same_bits(frame_of(room.capture, {}, path, whole, 0, 1, 1), expected)) << path;
}

// GB2
TEST(ShadingPaths, TheDefaultMovesAndCountsNothingOfThem) {
  const Room room;
  RunSettings settings;
  const FrameResult plain = Device(room.capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}}).render(0),
                    named = frame_of(room.capture, {}, "visibility");
  EXPECT_TRUE(same_bits(plain, named));
  EXPECT_EQ(plain.model->timing.cycles, named.model->timing.cycles);
  const tilecore::GbufferCounters& c = plain.counters.gbuffer;
  EXPECT_EQ(c.filled + c.samples + c.light_warps + c.tile_bytes + c.depth_bytes + c.spilled_bytes, 0u);
  const memory::Traffic attachments = plain.counters.ledger.traffic(Unit::kResolve, Purpose::kAttachment);
  EXPECT_EQ(attachments.read_bytes + attachments.written_bytes, 0u);
  std::vector<std::string> passes;
  for (const PassResult& pass : plain.passes) passes.push_back(pass.name);
  EXPECT_THAT(passes, testing::ElementsAre("main"));
}

// GB4
TEST(ShadingPaths, EveryLitInvocationIsFilledOnce) {
  Room room;
  for (scene::Material& m : room.capture.materials)
    m.unlit = false, m.effects.reset(), m.alpha_mode = scene::AlphaMode::kOpaque;
  for (const char* layout : {"exact", "packed"}) {
    const FrameResult frame = frame_of(room.capture, {std::string("gbuffer.layout=") + layout}, "gbuffer");
    const tilecore::GbufferCounters& c = frame.counters.gbuffer;
    EXPECT_EQ(c.filled, frame.counters.shading.pixel_shader_invocations) << layout;
    EXPECT_EQ(c.samples, frame.counters.shading.samples_visible) << layout;
  }
}

// The light half of the packed layout asks for no triangles: its warps are as full as the tile allows.
TEST(ShadingPaths, PackedWarpsOfLightAreFull) {
  const Room room;
  const FrameResult exact = frame_of(room.capture, {}, "gbuffer"),
                    packed = frame_of(room.capture, {"gbuffer.layout=packed"}, "gbuffer");
  EXPECT_LT(packed.counters.gbuffer.light_warps, exact.counters.gbuffer.light_warps);
  const std::uint64_t lanes = 32, tiles = packed.maps.tiles.size();
  EXPECT_LE(packed.counters.gbuffer.light_warps, packed.counters.gbuffer.filled / lanes + tiles);
  EXPECT_GE(packed.counters.gbuffer.light_warps * lanes, packed.counters.gbuffer.filled);
}

// ---- The error of the packed layout ------------------------------------------------------------------------------

TEST(ShadingPaths, PackedIsWithinFortyFiveDecibels) {
  for (const char* name : {"city_evening", "garden_lamps"}) {
    const Capture capture = scene::read_capture(test::shipped_capture(name));
    const IntRect whole{0, 0, 240, 136};
    const FrameResult exact = frame_of(capture, {}, "gbuffer", whole, 0, 240, 136),
                      packed = frame_of(capture, {"gbuffer.layout=packed"}, "gbuffer", whole, 0, 240, 136);
    const double found = psnr(test::displayed(packed.targets.color), test::displayed(exact.targets.color));
    RecordProperty(name, std::to_string(found));
    EXPECT_GE(found, 45.0) << name;
    EXPECT_FALSE(same_bits(packed, exact)) << name;
  }
}

// ---- Bytes -------------------------------------------------------------------------------------------------------

memory::Traffic attachments_of(const FrameResult& frame) {
  const memory::Traffic stored = frame.counters.ledger.traffic(Unit::kResolve, Purpose::kAttachment),
                        loaded = frame.counters.ledger.traffic(Unit::kTilecore, Purpose::kAttachment);
  return {stored.read_bytes + loaded.read_bytes, stored.written_bytes + loaded.written_bytes};
}

// GB3: 1920x1080 of 16 bytes, 33 177 600 each way, with depths of 4 bytes beside them; 64 bytes name their triangles.
TEST(ShadingPaths, StoredGbuffersHaveClosedForms) {
  const test::FloorScene floor;
  const IntRect whole{0, 0, 1920, 1080};
  const auto of = [&](const char* path, const char* layout, const char* samples) {
    return frame_of(floor.capture,
                    {std::string("gbuffer.layout=") + layout, std::string("sampling.samples_per_pixel=") + samples,
                     "frame_buffer.compression=none"},
                    path, whole, 0, 1920, 1080);
  };
  constexpr std::uint64_t kPixels = 1920 * 1080, kColors = 33'177'600, kDepths = 4 * kPixels;
  const FrameResult packed = of("gbuffer_external", "packed", "1");
  EXPECT_EQ(packed.counters.gbuffer.stored_bytes, kColors);
  EXPECT_EQ(packed.counters.gbuffer.loaded_bytes, kColors);
  EXPECT_EQ(packed.counters.gbuffer.depth_bytes, 2 * kDepths);
  EXPECT_EQ(attachments_of(packed).written_bytes, kColors + kDepths);
  EXPECT_EQ(attachments_of(packed).read_bytes, kColors + kDepths);
  const FrameResult exact = of("gbuffer_external", "exact", "1");
  EXPECT_EQ(attachments_of(exact).written_bytes, 64 * kPixels);
  EXPECT_EQ(attachments_of(exact).read_bytes, 64 * kPixels);
  const FrameResult twice = of("gbuffer_external", "packed", "2");
  EXPECT_EQ(attachments_of(twice).written_bytes, 2 * (kColors + kDepths));
  const FrameResult prepass = of("prepass", "exact", "1");
  EXPECT_EQ(attachments_of(prepass).written_bytes, kDepths);
  EXPECT_EQ(attachments_of(prepass).read_bytes, kDepths);
  for (const char* path : {"visibility", "gbuffer"}) {
    const memory::Traffic none = attachments_of(of(path, "packed", "1"));
    EXPECT_EQ(none.read_bytes + none.written_bytes, 0u) << path;
  }
}

// ---- Paths that a capture's passes name -----------------------------------------------------------------------------

TEST(ShadingPaths, PassesNameAPathAndItsGbuffer) {  // GRA5
  Room room;
  const std::map<std::string, std::vector<std::string>> names = {
      {"prepass", {"depths", "draw"}}, {"gbuffer", {"draw"}}, {"gbuffer_external", {"draw", "lit"}}};
  for (const auto& [path, passes] : names) {
    room.capture.settings.graph.reset();
    const FrameResult chosen = frame_of(room.capture, {"gbuffer.layout=packed", "gbuffer.bits=192"}, path);
    room.capture.settings.graph = test::shading_graph(path);
    const std::optional<scene::GraphFault> fault = find_fault(*room.capture.settings.graph);
    ASSERT_FALSE(fault) << path << " " << fault->pointer << " " << fault->text;
    const FrameResult named = frame_of(room.capture, {}, "visibility");
    EXPECT_EQ(named.targets.color.values, chosen.targets.color.values) << path;
    EXPECT_EQ(named.counters.ledger.total().read_bytes, chosen.counters.ledger.total().read_bytes) << path;
    EXPECT_EQ(named.counters.ledger.total().written_bytes, chosen.counters.ledger.total().written_bytes) << path;
    EXPECT_EQ(named.model->timing.cycles, chosen.model->timing.cycles) << path;
    std::vector<std::string> found;
    for (const PassResult& pass : named.passes) found.push_back(pass.name);
    EXPECT_EQ(found, passes);
    EXPECT_THROW(frame_of(room.capture, {}, path == "prepass" ? "gbuffer" : "prepass"), UsageError);
  }
}

TEST(ShadingPaths, WiderGbuffersCostBytesAndClocksAlone) {
  const Room room;
  for (const char* path : {"gbuffer", "gbuffer_external"}) {
    const auto of = [&](const char* bits) {
      return frame_of(room.capture,
                      {"gbuffer.layout=packed", "frame_buffer.compression=none", std::string("gbuffer.bits=") + bits},
                      path);
    };
    const FrameResult narrow = of("128"), wide = of("256");
    EXPECT_EQ(wide.targets.color.values, narrow.targets.color.values) << path;
    EXPECT_EQ(wide.counters.gbuffer.tile_bytes, 2 * narrow.counters.gbuffer.tile_bytes) << path;
    EXPECT_EQ(wide.counters.gbuffer.stored_bytes, 2 * narrow.counters.gbuffer.stored_bytes) << path;
    EXPECT_GT(wide.model->timing.cycles, narrow.model->timing.cycles) << path;
    EXPECT_GT(wide.model->energy.total_nj(), narrow.model->energy.total_nj()) << path;
    EXPECT_THROW(of("144"), UsageError);
  }
}

TEST(ShadingPaths, ANarrowGbufferLeavesEmissionToOneShader) {
  Room room;
  const auto of = [&](const char* bits) {
    return frame_of(room.capture, {"gbuffer.layout=packed", std::string("gbuffer.bits=") + bits}, "gbuffer");
  };
  const auto emit = [&](float light) {
    for (scene::Material& material : room.capture.materials) material.emissive = Vec3(light);
  };
  emit(0);
  const FrameResult dark = of("96"), dark_wide = of("128");
  EXPECT_EQ(dark.targets.color.values, dark_wide.targets.color.values);
  EXPECT_EQ(4 * dark.counters.gbuffer.tile_bytes, 3 * dark_wide.counters.gbuffer.tile_bytes);
  EXPECT_LT(dark.model->timing.cycles, dark_wide.model->timing.cycles);
  EXPECT_GT(dark.counters.gbuffer.filled, 0u);
  emit(0.25f);
  EXPECT_EQ(of("96").counters.gbuffer.filled, 0u);
  EXPECT_GT(of("128").counters.gbuffer.filled, 0u);
  EXPECT_EQ(of("96").targets.color.values, frame_of(room.capture, {}, "visibility").targets.color.values);
}

TEST(ShadingPaths, AFurtherWordCostsWhatAPackedOneDoes) {
  const auto rows = hardware::shader_cost_rows();
  const auto packed = std::ranges::find(rows, "add/fill/packed", &hardware::ShaderCostRow::name);
  ASSERT_NE(packed, rows.end());
  EXPECT_EQ(4 * tilecore::kGbufferWordClocks, hardware::lane_clocks(packed->cost));
}

TEST(ShadingPaths, TheGbufferOnChipMovesBytesOfTheTileMemoryAlone) {
  const Room room;
  const FrameResult plain = frame_of(room.capture, {}, "visibility");
  for (const auto& [layout, bytes] : {std::pair{"exact", 64u}, {"packed", 16u}}) {
    const FrameResult frame = frame_of(room.capture, {std::string("gbuffer.layout=") + layout}, "gbuffer");
    const tilecore::GbufferCounters& c = frame.counters.gbuffer;
    const std::uint64_t records = bytes == 64 ? 16 * c.filled : 0;
    EXPECT_EQ(c.tile_bytes, bytes * (c.samples + c.filled) + records) << layout;
    EXPECT_EQ(frame.counters.ledger.total().written_bytes, plain.counters.ledger.total().written_bytes) << layout;
    EXPECT_GT(frame.model->timing.cycles, 0) << layout;
  }
}

TEST(ShadingPaths, PassesAreCharged) {
  const Room room;
  const auto names = [](const FrameResult& frame) {
    std::vector<std::string> passes;
    for (const PassResult& pass : frame.passes) passes.push_back(pass.name);
    return passes;
  };
  const FrameResult prepass = frame_of(room.capture, {}, "prepass"), plain = frame_of(room.capture, {}, "visibility"),
                    external = frame_of(room.capture, {}, "gbuffer_external");
  EXPECT_THAT(names(prepass), testing::ElementsAre("prepass", "main"));
  EXPECT_THAT(names(external), testing::ElementsAre("main", "light"));
  EXPECT_GT(prepass.model->timing.cycles, plain.model->timing.cycles);
  EXPECT_GT(external.model->energy.total_nj(), plain.model->energy.total_nj());
  // Blended layers wait in memory for the light half.
  EXPECT_GT(external.counters.gbuffer.layer_bytes, 0u);
  // Hidden sub-patches are not tessellated again.
  const std::uint64_t once = plain.counters.tessellation.requests;
  EXPECT_LE(prepass.counters.tessellation.requests, 2 * once);
}

// ---- Tiles -------------------------------------------------------------------------------------------------------

std::uint64_t sample_bytes(std::uint64_t gbuffer_bits) {
  return tilecore::SampleLayout{16, false, false, false, gbuffer_bits / 8}.room_bytes();
}

// Known answers: w h spp (4 + max(16, bits / 8)) <= memory.
TEST(TileFit, StateOfKnownTiles) {
  constexpr std::uint64_t kMemory = 192 << 10, kSamples = 32 * 32 * 4;
  EXPECT_EQ(kSamples * sample_bytes(128), 80u << 10);
  EXPECT_EQ(kSamples * sample_bytes(256), 144u << 10);
  EXPECT_EQ(kSamples * sample_bytes(512), 272u << 10);
  using hardware::TilePixels;
  const auto tile = [&](std::uint64_t bits, std::uint64_t tiles) {
    return hardware::largest_tile(4 * sample_bytes(bits), kMemory, tiles);
  };
  EXPECT_EQ(tile(128, 2), (TilePixels{32, 32}));
  EXPECT_EQ(tile(256, 1), (TilePixels{32, 32}));
  EXPECT_EQ(tile(256, 2), (TilePixels{32, 16}));
  EXPECT_EQ(tile(512, 1), (TilePixels{32, 16}));
  EXPECT_EQ(tile(512, 2), (TilePixels{16, 16}));
}

// The largest power of two that fits, for any widths, samples and memories: the next one does not, unless it is the largest.
TEST(TileFit, NoLargerTileFits) {
  Random random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto bits = static_cast<std::uint64_t>(16 * random.integer(8, 64)),
               samples = std::uint64_t{1} << random.integer(0, 4),
               memory = static_cast<std::uint64_t>(random.integer(1 << 10, 1 << 20)),
               tiles = static_cast<std::uint64_t>(random.integer(1, 3));
    const std::uint64_t pixel = samples * (4 + std::max<std::uint64_t>(16, bits / 8));
    ASSERT_EQ(pixel, samples * sample_bytes(bits));
    const hardware::TilePixels tile = hardware::largest_tile(pixel, memory, tiles);
    const auto pixels = static_cast<std::uint64_t>(tile.width) * static_cast<std::uint64_t>(tile.height);
    EXPECT_TRUE(pixels == 64 || tiles * pixels * pixel <= memory);
    EXPECT_TRUE(pixels == 4096 || tiles * 2 * pixels * pixel > memory);
    EXPECT_TRUE(tile.width == tile.height || tile.width == 2 * tile.height);
  }
}

// With the memories of published GPUs the rule gives their tiles.
TEST(TileFit, PublishedTilesFollowFromPublishedMemories) {
  const auto rule = [](int bytes, std::uint64_t memory) {
    return hardware::largest_tile(static_cast<std::uint64_t>(bytes), memory, 1);
  };
  for (const int bytes : {32, 64}) {
    const std::array<int, 1> color = {bytes};
    EXPECT_EQ(rule(bytes, 32768), hardware::apple_tile({color, 1})) << bytes;
    EXPECT_EQ(rule(bytes, 8192), hardware::mali_tile("G72", {color, 1})) << bytes;
  }
  for (const int bytes : {4, 8, 16}) {
    const std::array<int, 1> color = {bytes};
    EXPECT_EQ(rule(bytes, 16384), hardware::v3d_tile(7, {color, 1})) << bytes;
  }
}

TEST(TileFit, TilesFollowFromTheMemoryAndThePath) {
  const auto tile_of = [](const Keys& keys) {
    RunSettings settings;
    GpuConfiguration gpu;
    for (const std::string& key : keys) apply_setting(key, settings, gpu);
    EXPECT_EQ(fit_tile_memory(gpu, settings, true), "");
    return std::pair(gpu.tile.width, gpu.tile.height);
  };
  const auto with = [&](const char* path, const char* layout) {
    return tile_of({"tile.fit=true", "tilecore.memory_bytes=196608", "sampling.samples_per_pixel=4",
                    std::string("shading.path=") + path, std::string("gbuffer.layout=") + layout});
  };
  EXPECT_EQ(with("visibility", "exact"), std::pair(64, 32));
  EXPECT_EQ(with("gbuffer", "packed"), std::pair(32, 32));
  EXPECT_EQ(with("gbuffer", "exact"), std::pair(16, 16));
  EXPECT_EQ(tile_of({"tilecore.memory_bytes=196608"}), std::pair(32, 32)) << "off by default";
}

TEST(TileFit, SpillIsCharged) {
  const Room room;
  const Keys keys = {"tile.fit=true", "tilecore.memory_bytes=4096", "sampling.samples_per_pixel=4"};
  const FrameResult fits = frame_of(room.capture, {keys[0], keys[2]}, "gbuffer"),
                    spills = frame_of(room.capture, keys, "gbuffer");
  EXPECT_EQ(fits.counters.gbuffer.spilled_bytes, 0u);
  // 8x8 pixels, 4 samples of 68 bytes.
  constexpr std::uint64_t kTile = 8 * 8 * 4 * 68 - 4096, kTiles = (kWidth / 8) * (kHeight / 8);
  static_assert(kTile % 64 == 0);
  EXPECT_EQ(spills.counters.gbuffer.spilled_bytes, 2 * kTile * kTiles);
  const memory::Traffic state = spills.counters.ledger.traffic(Unit::kTilecore, Purpose::kTileState);
  EXPECT_EQ(state.read_bytes, kTile * kTiles);
  EXPECT_EQ(state.written_bytes, kTile * kTiles);
  EXPECT_EQ(frame_of(room.capture, keys, "visibility").counters.gbuffer.spilled_bytes, 0u) << "12 bytes fit";
  EXPECT_TRUE(same_bits(fits, spills));
}

// ---- Refusals ----------------------------------------------------------------------------------------------------

TEST(ShadingPaths, RefusesWhatDoesNotGoTogether) {
  Room glass;
  glass.capture.materials[4].transmission.factor = 0.8f;
  glass.capture.materials[4].effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
  const Room room;
  const auto message = [](const Room& of, const Keys& keys, const std::string& path) -> std::string {
    try {
      frame_of(of.capture, keys, path);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message(room, {"shading.rate=cache"}, "gbuffer"),
              testing::StartsWith("shading.path=gbuffer with shading.rate=cache: "));
  EXPECT_THAT(message(room, {"resolve.desampling=adaptive"}, "gbuffer_external"),
              testing::StartsWith("shading.path=gbuffer_external with resolve.desampling: "));
  for (const std::string path : {"prepass", "gbuffer_external"}) {
    EXPECT_THAT(message(glass, {}, path),
                testing::StartsWith("shading.path=" + path + " with surfaces that transmit: "));
    const std::string key = "frontend.previous_depth_culling=true";
    EXPECT_THAT(message(room, {key}, path), testing::StartsWith("shading.path=" + path + " with " + key + ": "));
    EXPECT_EQ(message(room, {"tile.rendering_elimination=true"}, path), "");
  }
  for (const std::string key : {"frontend.previous_depth_culling=true", "tile.rendering_elimination=true"}) {
    EXPECT_EQ(message(room, {key}, "gbuffer"), "") << key;
    EXPECT_EQ(message(room, {key}, "visibility"), "") << key;
  }
  EXPECT_EQ(message(room, {"shading.rate=cache"}, "prepass"), "");
  RunSettings settings;
  settings.shading.path = tilecore::ShadingPath::kGbuffer;
  struct Nobody final : ViewObserver {
    void view_rendered(const RenderedView&) override {}
  } nobody;
  Device device(room.capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  EXPECT_THROW(device.set_observer(&nobody), UsageError);
}

}  // namespace
}  // namespace tessera::gpu::shading_paths_test
