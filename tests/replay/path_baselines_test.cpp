// All machines on frames with a prepass or a G-buffer (baselines/surfaces.h, baselines/immediate.h, baselines/scheme_work.h).
#include "tests/replay/observed_passes.h"
#include "tests/support/lit_room.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::path_baselines_test {
namespace {

using baselines::BaselineCounters;
using baselines::BaselineSet;
using baselines::PassSet;
using baselines::SchemeId;
using hardware::Event;
using test::bursts;
using test::kPixels;
using test::observe;
using test::Observed;
using test::pass_named;
using Keys = std::vector<std::string>;

const std::array<std::string, 3> kPaths = {"prepass", "gbuffer", "gbuffer_external"};

Keys along(const std::string& path, Keys keys = {}) {
  keys.insert(keys.end(), {"shading.path=" + path, "gbuffer.layout=packed"});
  return keys;
}

const std::vector<test::ObservedSetting> kSettings = {
    {"one_sample", {"sampling.samples_per_pixel=1"}},
    {"four_samples", {"sampling.samples_per_pixel=4"}},
    {"raw", {"frame_buffer.compression=none", "immediate.color_compression=false"}},
    {"evaluated_pixels", {"shading.surface=evaluated"}},
    {"no_lists", {"shading.light_lists=off"}},
    {"wide", {"gbuffer.bits=224"}},
    {"no_emission", {"gbuffer.bits=96"}},
    {"phases", {"machine.timing=phases"}},
    {"shadows", {"effects.shadows=all", "shadows.size=32"}},
    {"shadows_in_phases", {"effects.shadows=all", "shadows.size=32", "machine.timing=phases"}},
    {"small_buffer", {"parameter_buffer.bytes=2048"}, true},
};

class PathBaselines : public testing::TestWithParam<std::string> {};

TEST_P(PathBaselines, BW1AndBW2AndOBS1AndOBS2HoldInEveryPass) {
  const test::Room room;
  for (const test::ObservedSetting& setting : kSettings) {
    Observed of = observe(room.capture, along(GetParam(), setting.keys));
    test::expect_invariants(of, setting);
  }
}

TEST_P(PathBaselines, OBS1PassesAddUpToTheFrame) {
  const Observed of = observe(test::Room().capture, along(GetParam()));
  EXPECT_EQ(test::counters_out_of_balance(of), 0);
  const BaselineCounters& tessera = of.set[SchemeId::kTessera];
  const memory::Traffic all = of.result.counters.ledger.total();
  EXPECT_EQ(tessera.dram_bytes + tessera.texture_bytes, all.read_bytes + all.written_bytes);
  EXPECT_EQ(tessera.cycles, static_cast<std::uint64_t>(std::ceil(of.result.model->timing.cycles)));
}

TEST_P(PathBaselines, ChangeNothingAndDoNotDependOnThreads) {
  const test::Room room;
  const Observed one = observe(room.capture, along(GetParam()), 1), three = observe(room.capture, along(GetParam()), 3);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    for (const auto& field : kCounterFields<BaselineCounters>)
      EXPECT_EQ(one.set.schemes[s].*field.member, three.set.schemes[s].*field.member) << field.name << s;
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  for (const std::string& key : along(GetParam())) gpu::apply_setting(key, settings, gpu);
  const gpu::FrameResult alone =
      gpu::Device(room.capture, gpu, settings, test::kObservedFrame).render(room.capture.settings.first_frame);
  EXPECT_EQ(alone.targets.color.values, one.result.targets.color.values);
  EXPECT_EQ(alone.model->timing.cycles, one.result.model->timing.cycles);
}

// A capture whose passes name the path is measured as the settings are.
TEST_P(PathBaselines, PassesOfACaptureNameThePath) {
  test::Room room;
  const Observed chosen = observe(room.capture, along(GetParam(), {"gbuffer.bits=192"}));
  room.capture.settings.graph = test::shading_graph(GetParam());
  const Observed named = observe(room.capture);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    EXPECT_EQ(named.set.schemes[s].dram_bytes, chosen.set.schemes[s].dram_bytes) << s;
    EXPECT_EQ(named.set.schemes[s].cycles, chosen.set.schemes[s].cycles) << s;
  }
  for (std::size_t k = 0; k < named.passes.size(); ++k) EXPECT_EQ(named.passes[k].name, named.result.passes[k].name);
}

INSTANTIATE_TEST_SUITE_P(Paths, PathBaselines, testing::ValuesIn(kPaths),
                         [](const auto& named) { return named.param; });

// ---- Closed forms --------------------------------------------------------------------------------------------------

// A floor that covers the frame and two cards above it, each over a quarter of the frame and drawn nearest last.
scene::Capture stack() {
  test::FloorScene scene;
  scene.add_card({0, 1, 0}, 2);
  scene.add_card({0, 2, 0}, 2);
  return std::move(scene.capture);
}

constexpr std::uint64_t kLines = 25 * 18;  // of 4x4 pixels, one sample each
const Keys kPlain = {"sampling.samples_per_pixel=1", "immediate.color_compression=false",
                     "frame_buffer.compression=none"};
Keys plain(const std::string& path, Keys more) {
  more.insert(more.end(), kPlain.begin(), kPlain.end());
  return along(path, more);
}

// A raw frame: each row of a tile's pixels in bursts.
std::uint64_t frame_bytes() {
  std::uint64_t bytes = 0;
  for (std::uint64_t x = 0; x < 100; x += 32) bytes += 70 * bursts(4 * std::min<std::uint64_t>(32, 100 - x));
  return bytes;
}

// An unlimited cache writes each line of depths, G-buffer and frame once, and the light half reads them on chip.
TEST(PathBytes, AnImmediateMachineStoresTheGbufferOnceAndReadsItToLight) {
  for (const auto& [bits, bytes] : {std::pair{"gbuffer.bits=128", std::uint64_t{16}}, {"gbuffer.bits=256", 32}}) {
    const auto of = [width = std::string(bits)](const std::string& path, const char* cache) {
      return observe(stack(), plain(path, {width, cache}));
    };
    const Observed large = of("gbuffer", "baselines.cache_bytes=1073741824");
    const BaselineCounters& all = large.set[SchemeId::kImmediate];
    EXPECT_EQ(all.frame_bytes_written, kLines * 16 * (4 + bytes) + frame_bytes());
    EXPECT_EQ(all.frame_bytes_read, 0u);
    // A stored G-buffer stays where the draws left it; the pass that lights it is every machine's.
    const Observed external = of("gbuffer_external", "baselines.cache_bytes=1073741824");
    const BaselineSet &draw = pass_named(external, "main").set, &light = pass_named(external, "light").set;
    EXPECT_EQ(draw[SchemeId::kImmediate].frame_bytes_written, kLines * 16 * (4 + bytes));
    for (const BaselineCounters& scheme : light.schemes) {
      EXPECT_EQ(scheme.frame_bytes_read, bursts(bytes * kPixels) + bursts(4 * kPixels));
      EXPECT_EQ(scheme.frame_bytes_written, frame_bytes());
    }
    // Without a cache each draw reads and writes its lines, and the light reads all.
    const Observed none = of("gbuffer", "baselines.cache_bytes=0"),
                   stored = of("gbuffer_external", "baselines.cache_bytes=0");
    EXPECT_EQ(none.set[SchemeId::kImmediate].frame_bytes_read -
                  pass_named(stored, "main").set[SchemeId::kImmediate].frame_bytes_read,
              kLines * 16 * (4 + bytes));
  }
}

TEST(PathBytes, TilesHoldDepthAndGbuffer) {
  const gpu::GpuConfiguration gpu;
  const auto pixels = static_cast<std::uint64_t>(gpu.tile.width * gpu.tile.height);
  const auto state = [&](const std::string& path, const char* bits) {
    return observe(stack(), plain(path, {bits})).work(SchemeId::kDeferredVertex).tile_state_bytes;
  };
  EXPECT_EQ(state("gbuffer", "gbuffer.bits=128"), pixels * (4 + 16));
  EXPECT_EQ(state("gbuffer_external", "gbuffer.bits=192"), pixels * (4 + 24));
  EXPECT_EQ(state("visibility", "gbuffer.bits=192"), pixels * (4 + 4));
}

// Without a prepass each card is shaded, although the next one hides it; with one every pixel is shaded once.
TEST(PathShading, APrepassSparesAnImmediateMachineItsOverdraw) {
  const BaselineCounters at_once = observe(stack(), plain("visibility", {})).set[SchemeId::kImmediate];
  const Observed of = observe(stack(), plain("prepass", {}));
  const BaselineSet &depths = pass_named(of, "prepass").set, &main = pass_named(of, "main").set;
  const std::uint64_t seen = of.result.counters.shading.pixel_shader_invocations;
  EXPECT_EQ(seen, kPixels);
  EXPECT_EQ(main[SchemeId::kImmediate].pixel_shader_invocations, seen);
  EXPECT_EQ(depths[SchemeId::kImmediate].pixel_shader_invocations, 0u);
  EXPECT_GT(at_once.pixel_shader_invocations, seen + kPixels / 3);
  // Depths are written by the prepass alone, colours by the pass behind it alone.
  const Observed large = observe(stack(), plain("prepass", {"baselines.cache_bytes=1073741824"}));
  const auto traffic = [&](const char* pass) { return pass_named(large, pass).set[SchemeId::kImmediate]; };
  EXPECT_EQ(traffic("prepass").frame_bytes_written, kLines * 64);
  EXPECT_EQ(traffic("main").frame_bytes_written, kLines * 64);
  EXPECT_EQ(traffic("prepass").frame_bytes_read, 0u);
  EXPECT_EQ(traffic("main").frame_bytes_read, kLines * 64);
}

// Blended surfaces leave no depth: a prepass draws none, and binned triangles are fewer by them.
TEST(PathShading, APrepassDrawsOpaqueSurfacesAlone) {
  const Observed of = observe(test::Room().capture, along("prepass"));
  const BaselineSet &depths = pass_named(of, "prepass").set, &main = pass_named(of, "main").set;
  for (const SchemeId s : test::triangle_schemes()) {
    EXPECT_LT(depths[s].primitives, main[s].primitives) << test::name_of(s);
    EXPECT_GT(depths[s].primitives, 0u) << test::name_of(s);
    EXPECT_LT(depths[s].bounding_operations, main[s].bounding_operations);
  }
  EXPECT_EQ(depths[SchemeId::kPostPosition].domain_evaluations, 0u) << "vertices have a place alone";
}

// Light halves are the machine's on every machine; an immediate machine fills what it draws.
TEST(PathShading, LightHalvesRunOnceOnEveryMachine) {
  const Observed of = observe(stack(), plain("gbuffer", {}));
  const timing::FrameWork& work = of.work(SchemeId::kImmediate);
  std::uint64_t drawn = 0, lit = 0;
  for (const timing::TileWork& batch : work.rounds.front().tiles) drawn += batch.events[Event::kShaderInvocations];
  for (const timing::TileWork& tile : work.rounds.back().tiles) lit += tile.events[Event::kShaderInvocations];
  EXPECT_EQ(lit, of.result.counters.gbuffer.filled);
  EXPECT_EQ(drawn, of.set[SchemeId::kImmediate].pixel_shader_invocations);
  EXPECT_GT(drawn, lit);
  // Fill halves of draws are cheaper than whole shaders.
  const auto clocks = [](const Observed& observed) {
    std::uint64_t sum = 0;
    for (const timing::TileItems& batch : observed.work(SchemeId::kImmediate).rounds.front().items)
      for (const timing::WarpItem& warp : batch.warps) sum += std::uint64_t{warp.clocks} * warp.lanes;
    return sum;
  };
  EXPECT_LT(clocks(of), clocks(observe(stack(), plain("visibility", {}))));
  // Tiles read the G-buffer on chip: energy of the tile memory.
  const auto on_chip = [&](const Observed& observed) {
    std::uint64_t bytes = 0;
    for (const timing::TileWork& tile : observed.work(SchemeId::kDeferredVertex).rounds.back().tiles)
      bytes += tile.events[Event::kTileBytes];
    return bytes;
  };
  EXPECT_EQ(on_chip(of), of.result.counters.gbuffer.tile_bytes);
  EXPECT_EQ(on_chip(observe(stack(), plain("visibility", {}))), 0u);
}

// Light halves look up shadow maps: on chip as many as in the light pass of a stored G-buffer, and immediate machines with them.
TEST(PathShading, LightHalvesLookUpShadowMaps) {
  test::Room room;
  for (scene::Material& material : room.capture.materials) material.alpha_mode = scene::AlphaMode::kOpaque;
  const Keys keys = {"effects.shadows=all", "shadows.size=32"};
  const Observed chip = observe(room.capture, along("gbuffer", keys)),
                 stored = observe(room.capture, along("gbuffer_external", keys));
  const auto light = std::ranges::find(stored.result.passes, "light", &gpu::PassResult::name);
  ASSERT_NE(light, stored.result.passes.end());
  EXPECT_GT(chip.result.counters.gbuffer.light_lookups, 0u);
  EXPECT_EQ(chip.result.counters.gbuffer.light_lookups, light->counters.texture.texels);
  std::uint64_t looked_up = 0;
  const timing::FrameWork& work = chip.work(SchemeId::kImmediate);
  for (const timing::TileWork& tile : work.rounds.back().tiles) looked_up += tile.events[Event::kTexels];
  EXPECT_EQ(looked_up, light->counters.texture.texels);
}

TEST(PathBaselineRefusals, TheExactGbufferIsRefused) {
  for (const std::string path : {"gbuffer", "gbuffer_external"}) {
    try {
      observe(stack(), {"shading.path=" + path});
      ADD_FAILURE() << path;
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), testing::EndsWith("gbuffer.layout=packed"));
    }
  }
}

}  // namespace
}  // namespace tessera::replay::path_baselines_test
