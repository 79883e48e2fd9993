// All machines on frames with surfaces that transmit: the scene behind them, its image, and the tiles that show them
// (baselines/scheme_work.h).
#include "baselines/triangle_setup.h"
#include "tests/replay/observed_passes.h"
#include "tests/support/lit_room.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::transmission_baselines_test {
namespace {

using baselines::BaselineCounters;
using baselines::BaselineSet;
using baselines::SchemeId;
using hardware::Event;
using test::bursts;
using test::kPixels;
using test::observe;
using test::Observed;
using test::pass_named;
using Keys = std::vector<std::string>;

scene::Material window_glass() {
  scene::Material glass;
  glass.metallic = 0, glass.roughness = 0.3f, glass.transmission.factor = 1;
  glass.double_sided = true;
  glass.effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
  return glass;
}

// The room with two windows that transmit, one before the other, each before a part of the frame.
scene::Capture windowed_room() {
  test::Room room;
  const int glass = test::add_material(room.capture, window_glass());
  for (const double z : {0.6, 1.4})
    test::add_node(room.capture, test::patches(test::flat_patch({0, 0, 0}, {0.6, 0, 0}, {0, 0.5, 0}), glass),
                   {-0.1, 0.2, z});
  return std::move(room.capture);
}

const std::vector<test::ObservedSetting> kSettings = {
    {"one_sample", {"sampling.samples_per_pixel=1"}},
    {"four_samples", {"sampling.samples_per_pixel=4"}},
    {"raw", {"frame_buffer.compression=none", "immediate.color_compression=false"}},
    {"small_bins", {"visibility_stream.gmem_bytes=65536"}},
    {"gbuffer", {"shading.path=gbuffer", "gbuffer.layout=packed"}},
    {"phases", {"machine.timing=phases"}},
    {"shadows", {"effects.shadows=all", "shadows.size=32"}},
    {"small_buffer", {"parameter_buffer.bytes=2048"}, true},
};

TEST(TransmissionBaselines, BW1AndBW2AndOBS1AndOBS2HoldInEveryPass) {
  const scene::Capture capture = windowed_room();
  for (const test::ObservedSetting& setting : kSettings) {
    Observed of = observe(capture, setting.keys);
    ASSERT_GT(of.passes.size(), 2u) << setting.name;
    EXPECT_EQ(of.passes[of.passes.size() - 3].name, "behind") << setting.name;
    test::expect_invariants(of, setting);
    // The failing twin: a surface that is shaded once more.
    ++of.works[test::index(SchemeId::kDeferredVertex)].rounds.back().tiles.front().events[Event::kShaderInvocations];
    EXPECT_EQ(test::passes_shaded_otherwise(of), 1) << setting.name;
  }
}

TEST(TransmissionBaselines, ChangeNothingAndDoNotDependOnThreads) {
  const scene::Capture capture = windowed_room();
  const Observed one = observe(capture, {}, 1), three = observe(capture, {}, 3);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    for (const auto& field : kCounterFields<BaselineCounters>)
      EXPECT_EQ(one.set.schemes[s].*field.member, three.set.schemes[s].*field.member) << field.name << s;
  const gpu::FrameResult alone = gpu::Device(capture, {}, {}, test::kObservedFrame).render(0);
  EXPECT_EQ(alone.targets.color.values, one.result.targets.color.values);
  EXPECT_EQ(alone.model->timing.cycles, one.result.model->timing.cycles);
}

TEST(TransmissionBaselines, FramesWithoutSuchASurfaceInViewHaveOnePass) {
  scene::Capture capture = windowed_room();
  for (scene::Node& node : capture.nodes)
    if (node.transform.translation.x == -0.1) node.transform.translation.z = 40;
  const Observed of = observe(capture);
  ASSERT_EQ(of.passes.size(), 1u);
  EXPECT_EQ(of.passes[0].name, "main");
  EXPECT_EQ(test::out_of_balance(of), 0);
}

// An arch above the view, whose control points reach into it: the machine without splits draws its tiles in two passes, the
// others in one.
TEST(TransmissionBaselines, TheBoundsOfWholePatchesMayOpenTilesAlone) {
  test::Room room;
  const int glass = test::add_material(room.capture, window_glass());
  std::vector<Vec3> arch = test::flat_patch({-2, 0, 1}, {4, 0, 0}, {0, 0, 0.5});
  for (Vec3& p : arch) p.y = std::abs(p.x) > 1 ? 6.0f : 1.0f;
  test::add_node(room.capture, test::patches(arch, glass), {0, 0, 0});
  const Observed of = observe(room.capture, {"frontend.split_pixels=4"});
  ASSERT_EQ(of.passes.size(), 1u);
  EXPECT_EQ(test::out_of_balance(of), 0);
  EXPECT_EQ(test::counters_out_of_balance(of), 0);
  const BaselineCounters &ours = of.set[SchemeId::kTessera], &whole = of.set[SchemeId::kPatchWhole];
  EXPECT_GT(whole.frame_bytes_written, ours.frame_bytes_written) << "with the image behind the arch";
  EXPECT_GT(whole.domain_evaluations, ours.domain_evaluations);
  EXPECT_GT(whole.smallest_buffer_bytes, 0u);
}

// ---- Closed forms --------------------------------------------------------------------------------------------------

// A floor that covers the frame of 4x3 tiles, and a window over its middle, in columns 0 to 2 and rows 0 to 1. One sample
// a pixel, no compression.
struct Pane {
  static constexpr std::uint64_t kLines = 25 * 18;  // of 4x4 pixels
  static constexpr std::uint64_t kTileLines = 8 * 8;
  scene::Capture capture;

  // `half`: half the side of the window; 0: there is none.
  explicit Pane(double half = 2.2) {
    test::FloorScene scene;
    const int glass = test::add_material(scene.capture, window_glass());
    if (half > 0) test::add_node(scene.capture, test::rectangle(DVec2(-half), DVec2(half), glass), {0, 2, 0});
    capture = std::move(scene.capture);
  }
  Observed seen(Keys keys = {}) const {
    keys.insert(keys.end(),
                {"sampling.samples_per_pixel=1", "immediate.color_compression=false", "frame_buffer.compression=none"});
    return observe(capture, keys);
  }
};

// Bytes of a frame of columns and rows of tiles, in bursts for each row of a tile's pixels.
std::uint64_t frame_bytes(std::uint64_t width, std::uint64_t height) {
  std::uint64_t bytes = 0;
  for (std::uint64_t x = 0; x < width; x += 32) bytes += height * bursts(4 * std::min<std::uint64_t>(32, width - x));
  return bytes;
}

TEST(TransmissionBytes, TilesStoreTheImageBehindAndTheOpenTilesOnce) {
  const Observed of = Pane().seen();
  const std::uint64_t image = 8 * kPixels;
  const BaselineSet &behind = pass_named(of, "behind").set, &main = pass_named(of, "main").set;
  const memory::Ledger& first = of.result.passes[0].counters.ledger;
  EXPECT_EQ(first.traffic(memory::Unit::kResolve, memory::Purpose::kSceneColor).written_bytes, bursts(image));
  const std::uint64_t open = frame_bytes(96, 64), all = frame_bytes(100, 70);
  for (const SchemeId s : {SchemeId::kTessera, SchemeId::kPatchWhole, SchemeId::kPostTessellation,
                           SchemeId::kVisibilityStream, SchemeId::kControlList}) {
    EXPECT_EQ(behind[s].frame_bytes_written, bursts(image) + all - open) << test::name_of(s);
    EXPECT_EQ(main[s].frame_bytes_written, open) << test::name_of(s);
    EXPECT_EQ(main[s].frame_bytes_read, 0u) << test::name_of(s);
  }
}

// With an unlimited cache an immediate machine writes the lines that it draws once in each pass, and the image.
TEST(TransmissionBytes, AnImmediateMachineReadsItsColoursForTheImage) {
  const auto immediate = [](const char* cache, const char* pass, const Pane& pane = Pane()) {
    return pass_named(pane.seen({cache}), pass).set[SchemeId::kImmediate];
  };
  const char *const unlimited = "baselines.cache_bytes=1073741824", *const none = "baselines.cache_bytes=0";
  const BaselineCounters behind = immediate(unlimited, "behind"), main = immediate(unlimited, "main");
  EXPECT_EQ(behind.frame_bytes_written, Pane::kLines * (64 + 64) + bursts(8 * kPixels));
  EXPECT_EQ(behind.frame_bytes_read, 0u);
  EXPECT_EQ(main.frame_bytes_written, 6 * Pane::kTileLines * (64 + 64));
  EXPECT_EQ(main.frame_bytes_read, 0u);
  // Without a cache all colours are read again to make the image, which a frame of the floor alone does not have.
  const std::uint64_t drawing = immediate(none, "main", Pane(0)).frame_bytes_read;
  EXPECT_EQ(immediate(none, "behind").frame_bytes_read, drawing + Pane::kLines * 64);
}

// ---- Parts of the scene --------------------------------------------------------------------------------------------

TEST(TransmissionGeometry, EachPassHasItsSurfacesAndItsTiles) {
  const Observed of = Pane().seen();
  const BaselineSet &behind = pass_named(of, "behind").set, &main = pass_named(of, "main").set;
  for (const SchemeId s : test::triangle_schemes()) {
    EXPECT_EQ(behind[s].primitives, 2u) << test::name_of(s) << ": the floor";
    EXPECT_EQ(main[s].primitives, 4u) << test::name_of(s) << ": the floor and the window";
  }
  // The floor in all twelve tiles, and again in the six that the window touches.
  for (const SchemeId s : {SchemeId::kPostTessellation, SchemeId::kPostPosition, SchemeId::kDeferredVertex}) {
    EXPECT_EQ(behind[s].entries, 12u) << test::name_of(s);
    EXPECT_EQ(main[s].entries, 6u + 6) << test::name_of(s);
  }
  EXPECT_EQ(behind[SchemeId::kImmediate].pixel_shader_invocations, kPixels);
  // The opposite twin: a window of the whole frame opens all tiles.
  const Observed wide = Pane(12).seen();
  EXPECT_EQ(pass_named(wide, "main").set[SchemeId::kPostTessellation].entries, 12u + 12);
}

TEST(TransmissionGeometry, TrianglesOutsideOfDrawnTilesAreDropped) {
  const binner::TileGrid grid(64, 64, 32, 32);
  const scene::Projection projection;
  baselines::TessellatedPatch patch;
  patch.keep_negative = patch.keep_positive = true;
  const auto add = [&](float x, float y, float size) {
    const auto first = static_cast<std::uint32_t>(patch.x0.size());
    for (const Vec2& corner : {Vec2(0, 0), Vec2(size, 0), Vec2(0, size)}) {
      patch.x0.push_back(x + corner.x), patch.y0.push_back(y + corner.y), patch.z0.push_back(2);
      patch.projected.push_back(1);
    }
    patch.triangles.push_back({first, first + 1, first + 2});
  };
  add(2, 2, 8), add(40, 2, 8), add(2, 2, 50);
  patch.group_ends = {3};
  const auto run = [&](std::vector<bool> drawn, BaselineCounters& counters) {
    return baselines::TriangleSetup(grid, projection, std::move(drawn)).run(patch, counters);
  };
  BaselineCounters all, some;
  EXPECT_EQ(run({}, all).tiles.size(), 1u + 1 + 3);
  const baselines::TriangleList list = run({false, true, false, false}, some);
  EXPECT_EQ(list.tiles, (std::vector<binner::TileIndex>{1, 1}));
  EXPECT_EQ(some.primitives, 2u);
  EXPECT_EQ(some.culled_frustum, all.culled_frustum + 1);
}

}  // namespace
}  // namespace tessera::replay::transmission_baselines_test
