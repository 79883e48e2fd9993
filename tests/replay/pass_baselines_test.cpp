// Frames of several passes on all machines: shadow maps, attachments, blooms and copies, pass by pass.
#include "baselines/baseline_set.h"
#include "baselines/frame_work.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "replay/baseline_report.h"
#include "scene/capture_reader.h"
#include "tests/replay/observed_passes.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::pass_baselines_test {
namespace {

using baselines::BaselineCounters;
using baselines::BaselineSet;
using baselines::PassSet;
using baselines::SchemeId;
using hardware::Event;
using memory::Purpose;
using memory::Unit;
using test::attachment;
using test::bursts;
using test::by_way_of;
using test::bytes_of;
using test::drawing;
using test::index;
using test::kPixels;
using test::name_of;
using test::observe;
using test::Observed;
using test::over_image;
using test::pass_named;
using test::passes_out_of_balance;
using test::passes_shaded_otherwise;
using test::passes_stored_otherwise;
using test::shading_of;
using test::tiled;
using test::triangle_schemes;
using test::with_graph;
using Keys = std::vector<std::string>;

// ---- The shipped captures ------------------------------------------------------------------------------------------

const Keys kSmall = {"shadows.size=128"};

class PassBaselines : public testing::TestWithParam<const char*> {
 protected:
  scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
};

TEST_P(PassBaselines, BW1EachPassMovesTheBytesThatWereCounted) {
  Observed of = observe(capture, kSmall);
  ASSERT_EQ(of.passes.size(), of.result.passes.size());
  for (std::size_t k = 0; k < of.passes.size(); ++k) EXPECT_EQ(of.passes[k].name, of.result.passes[k].name);
  EXPECT_EQ(passes_out_of_balance(of), 0);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    EXPECT_EQ(of.works[s].dram_bytes(), of.set.schemes[s].dram_bytes + of.set.schemes[s].texture_bytes) << s;
  // The failing twin: a burst lost in one pass of each scheme.
  for (const SchemeId s : triangle_schemes()) of.works[index(s)].rounds.front().tiles.back().dram_bytes.back() += 64;
  EXPECT_EQ(passes_out_of_balance(of), static_cast<int>(triangle_schemes().size()));
}

TEST_P(PassBaselines, BW2TiledSchemesShadeEachPassAsTheMachineDoes) {
  Observed of = observe(capture, kSmall);
  EXPECT_EQ(passes_shaded_otherwise(of), 0);
  // The failing twin: the machine shades one more pixel of a pass.
  ++of.works[index(SchemeId::kTessera)].rounds.back().tiles.back().events[Event::kPixels];
  EXPECT_EQ(passes_shaded_otherwise(of), static_cast<int>(tiled(of, of.passes.size() - 1).size()));
}

TEST_P(PassBaselines, OBS1PassesAddUpToTheFrame) {
  const Observed of = observe(capture, kSmall);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    BaselineCounters sum;
    for (const PassSet& pass : of.passes) {
      EXPECT_EQ(pass.set.schemes[s].cycles + pass.set.schemes[s].energy_nj, 0u);
      merge(sum, pass.set.schemes[s]);
    }
    for (const auto& field : kCounterFields<BaselineCounters>)
      if (field.member != &BaselineCounters::cycles && field.member != &BaselineCounters::energy_nj) {
        EXPECT_EQ(of.set.schemes[s].*field.member, sum.*field.member) << field.name;
      }
    EXPECT_GT(of.set.schemes[s].cycles, 0u);
    EXPECT_GT(of.set.schemes[s].energy_nj, 0u);
  }
  // The machine's own are the counters of its frame.
  const BaselineCounters& tessera = of.set[SchemeId::kTessera];
  const memory::Traffic all = of.result.counters.ledger.total();
  EXPECT_EQ(tessera.dram_bytes + tessera.texture_bytes, all.read_bytes + all.written_bytes);
  EXPECT_EQ(tessera.entries, of.result.counters.binner.entries);
  EXPECT_EQ(tessera.queue_bytes_peak, of.result.counters.binner.queue_bytes_peak);
  EXPECT_EQ(tessera.cycles, static_cast<std::uint64_t>(std::ceil(of.result.model->timing.cycles)));
  // The failing twin: a frame without its first pass.
  BaselineSet rest;
  for (std::size_t pass = 1; pass < of.passes.size(); ++pass)
    merge(rest[SchemeId::kImmediate], of.passes[pass].set[SchemeId::kImmediate]);
  EXPECT_NE(rest[SchemeId::kImmediate].dram_bytes, of.set[SchemeId::kImmediate].dram_bytes);
}

TEST_P(PassBaselines, OBS2TilersLoadAndStoreAsMuchAsTheMachine) {
  const Observed of = observe(capture, kSmall);
  EXPECT_EQ(passes_stored_otherwise(of), 0);
  EXPECT_GT(passes_stored_otherwise(of, 1), 0);  // the twin
}

TEST_P(PassBaselines, ChangeNeitherImageNorCountersAndDoNotDependOnThreads) {
  const Observed one = observe(capture, kSmall, 1), three = observe(capture, kSmall, 3);
  EXPECT_EQ(baseline_passes_json(one.passes), baseline_passes_json(three.passes));
  EXPECT_EQ(baselines_json(one.set), baselines_json(three.set));
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  for (const std::string& key : kSmall) gpu::apply_setting(key, settings, gpu);
  gpu::Device alone(capture, gpu, settings, test::kObservedFrame);
  const gpu::FrameResult result = alone.render(capture.settings.first_frame);
  EXPECT_EQ(result.targets.color.values, one.result.targets.color.values);
  EXPECT_EQ(result.model->timing.cycles, one.result.model->timing.cycles);
  EXPECT_EQ(result.counters.ledger.total().read_bytes, one.result.counters.ledger.total().read_bytes);
}

// How the front end cuts patches is nothing to machines that tessellate first, in maps as little as in the view.
TEST_P(PassBaselines, TriangleMachinesDoNotDependOnSplits) {
  Keys coarse = kSmall, fine = kSmall;
  coarse.emplace_back("frontend.split_pixels=256"), fine.emplace_back("frontend.split_pixels=8");
  const Observed a = observe(capture, coarse), b = observe(capture, fine);
  ASSERT_EQ(a.passes.size(), b.passes.size());
  for (std::size_t pass = 0; pass < a.passes.size(); ++pass)
    for (const SchemeId s : triangle_schemes())
      for (const auto& field : kCounterFields<BaselineCounters>)
        if (field.member != &BaselineCounters::texture_bytes) {
          EXPECT_EQ(a.passes[pass].set[s].*field.member, b.passes[pass].set[s].*field.member)
              << a.passes[pass].name << ' ' << name_of(s) << ' ' << field.name;
        }
}

INSTANTIATE_TEST_SUITE_P(Captures, PassBaselines, testing::Values("city_evening", "garden_lamps", "corridor"),
                         [](const auto& named) { return std::string(named.param); });

// ---- Closed forms --------------------------------------------------------------------------------------------------

using scene::Attachment;
using scene::AttachmentFormat;
using scene::DrawFilter;
using scene::LoadAction;
using scene::Pass;
using scene::PassGraph;
using scene::PassShader;
using scene::StoreAction;

// A floor of patches under a lamp, and a card that casts, with a graph of passes.
scene::Capture floor_scene(std::optional<PassGraph> graph, bool casts = false, bool masked = false) {
  test::FloorScene scene;
  scene::Capture& capture = scene.capture;
  scene::Material material = test::matt_white();
  if (masked) material.alpha_mode = scene::AlphaMode::kMask;
  scene::Primitive card =
      test::patches(test::flat_patch({-1, 0, -1}, {2, 0, 0}, {0, 0, 2}), test::add_material(capture, material));
  test::add_node(capture, std::move(card), DVec3(0, 2, 0));
  if (casts) {
    shaders::Light sun;
    sun.type = shaders::Light::Type::kDirectional;
    sun.color = Vec3(3.0f);
    scene::made::add_light(capture, sun, DVec3(0, 8, 0), DVec3(0, -1, 0), {.size = 128});
  }
  return with_graph(std::move(capture), std::move(graph));
}

// Known answer 1 on every machine: W x H x bytes of a pixel, stored once and read once.
TEST(PassBytes, AnAttachmentTakesItsPixelsEachWay) {
  for (const char* samples : {"sampling.samples_per_pixel=1", "sampling.samples_per_pixel=4"})
    for (const auto& [format, bytes] : {std::pair{AttachmentFormat::kRgba8, 4}, {AttachmentFormat::kRgba16F, 8}}) {
      const Observed of = observe(floor_scene(by_way_of(format)), {samples, "frame_buffer.compression=none"});
      const std::uint64_t lit = bursts(kPixels * static_cast<std::uint64_t>(bytes));
      const PassSet &draw = pass_named(of, "draw"), &final = pass_named(of, "final");
      for (const SchemeId s : tiled(of, 0)) {
        EXPECT_EQ(draw.set[s].frame_bytes_written - draw.set[s].frame_bytes_read, lit) << name_of(s);
        EXPECT_EQ(draw.set[s].pixel_shader_invocations, of.result.counters.shading.pixel_shader_invocations);
      }
      for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
        EXPECT_EQ(final.set.schemes[s].frame_bytes_read, lit) << s;
      EXPECT_EQ(passes_stored_otherwise(of), 0);
      EXPECT_EQ(passes_out_of_balance(of), 0);
    }
}

// An immediate machine's colours have the bytes of their attachment: the floor covers the frame, so that without a
// resolve each line of colour is written at least once.
TEST(PassBytes, AnImmediateMachineStoresColorsOfTheAttachmentsFormat) {
  const Keys keys = {"sampling.samples_per_pixel=1", "immediate.color_compression=false",
                     "baselines.cache_bytes=1073741824"};
  const auto moved = [&](AttachmentFormat format) {
    return pass_named(observe(floor_scene(by_way_of(format)), keys), "draw").set[SchemeId::kImmediate];
  };
  const BaselineCounters narrow = moved(AttachmentFormat::kRgba8), wide = moved(AttachmentFormat::kRgba16F);
  // 4x4 pixels a line of 64 bytes: 25 x 18 lines of depth, and as many of colour, or twice as many.
  EXPECT_EQ(narrow.frame_bytes_written, 25u * 18 * 64 * 2);
  EXPECT_EQ(wide.frame_bytes_written, 25u * 18 * 64 * 3);
  EXPECT_EQ(narrow.frame_bytes_read + wide.frame_bytes_read, 0u);
}

TEST(PassBytes, LoadsAndStoredDepthsMoveOnAllTilers) {
  const std::uint64_t spp = 4;
  for (const auto& [store, depths] : {std::pair{StoreAction::kStore, spp}, {StoreAction::kResolve, std::uint64_t{1}}}) {
    Pass pass = drawing("frame");
    const Keys keys = {"frame_buffer.compression=none", "immediate.color_compression=false"};
    const Observed plain = observe(floor_scene(PassGraph{{}, {pass}}), keys);
    pass.load = {{"frame", LoadAction::kLoad}};
    pass.store = {{"depth", store}};
    const Observed found = observe(floor_scene(PassGraph{{}, {pass}}), keys);
    EXPECT_EQ(passes_stored_otherwise(found), 0);
    EXPECT_EQ(passes_out_of_balance(found), 0);
    for (const SchemeId s : tiled(found, 0)) {
      const BaselineCounters &more = found.set[s], &less = plain.set[s];
      EXPECT_EQ(more.frame_bytes_written - less.frame_bytes_written, bursts(4 * depths * kPixels)) << name_of(s);
      EXPECT_EQ(more.frame_bytes_read - less.frame_bytes_read, plain.set[SchemeId::kTessera].frame_bytes_written);
      EXPECT_EQ(more.queue_bytes_written, less.queue_bytes_written);
    }
    // Depths of samples are in memory in any case, and so is a frame that is loaded.
    const BaselineCounters &more = found.set[SchemeId::kImmediate], &less = plain.set[SchemeId::kImmediate];
    EXPECT_EQ(more.frame_bytes_written - less.frame_bytes_written,
              store == StoreAction::kStore ? 0 : bursts(4 * kPixels));
  }
}

TEST(PassBytes, ABloomIsAlikeOnAllMachines) {
  PassGraph graph = by_way_of(AttachmentFormat::kRgba16F);
  graph.attachments.push_back(attachment("glow", AttachmentFormat::kR11G11B10F, 0.5, 3));
  graph.passes[1] = over_image("bloom", PassShader::kBloom, {"lit"}, "glow");
  graph.passes.push_back(over_image("final", PassShader::kTonemap, {"lit", "glow"}, "frame"));
  const Observed of = observe(floor_scene(graph), {"frame_buffer.compression=none"});
  ASSERT_EQ(of.passes.size(), 1u + 5 + 1);
  const std::array<std::uint64_t, 3> levels = {50 * 35 * 4, 25 * 17 * 4, 12 * 8 * 4};
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    for (std::size_t level = 0; level < 3; ++level) {
      const BaselineCounters& down = of.passes[1 + level].set.schemes[s];
      EXPECT_EQ(down.frame_bytes_written, bursts(levels[level])) << of.passes[1 + level].name;
      EXPECT_EQ(down.frame_bytes_read, level == 0 ? bursts(kPixels * 8) : bursts(levels[level - 1]));
    }
  EXPECT_EQ(passes_out_of_balance(of), 0);
  EXPECT_EQ(passes_shaded_otherwise(of), 0);
}

// The second frame has a history. Immediate machines resolve depths and velocities into the bytes that tiles store.
TEST(PassBytes, TemporalAntialiasingIsAlikeOnAllMachines) {
  for (const std::string key : {"frame_buffer.compression=none", "frame_buffer.compression=lossless"})
    for (const bool depths : {false, true}) {
      const Observed of = observe(floor_scene(test::antialiasing(depths)), {key, "sampling.samples_per_pixel=4"}, 0, 2);
      EXPECT_EQ(passes_stored_otherwise(of), 0);
      EXPECT_EQ(passes_out_of_balance(of), 0);
      EXPECT_EQ(passes_shaded_otherwise(of), 0);
      const PassSet& history = pass_named(of, "taa");
      for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
        EXPECT_EQ(history.set.schemes[s].frame_bytes_read, history.set[SchemeId::kTessera].frame_bytes_read) << s;
        EXPECT_EQ(history.set.schemes[s].frame_bytes_written, history.set[SchemeId::kTessera].frame_bytes_written) << s;
      }
      const PassSet& draw = pass_named(of, "draw");
      const std::uint64_t resolved = draw.set[SchemeId::kTessera].frame_bytes_written;
      EXPECT_GT(draw.set[SchemeId::kImmediate].frame_bytes_written, resolved);
      // The first frame moves no history.
      const Observed first = observe(floor_scene(test::antialiasing(depths)), {key, "sampling.samples_per_pixel=4"});
      EXPECT_LT(pass_named(first, "taa").set[SchemeId::kTessera].frame_bytes_read,
                history.set[SchemeId::kTessera].frame_bytes_read);
    }
}

// ---- Shadow maps ---------------------------------------------------------------------------------------------------

TEST(MapBaselines, ShadePositionsAlone) {
  const Observed plain = observe(floor_scene({}, true)), masked = observe(floor_scene({}, true, true));
  const BaselineSet &map = plain.passes.front().set, &with_mask = masked.passes.front().set;
  ASSERT_EQ(plain.passes.size(), 2u);
  const hardware::EventCounts machine = shading_of(plain.work(SchemeId::kTessera), 0);
  for (const SchemeId s : triangle_schemes()) {
    EXPECT_EQ(map[s].pixel_shader_invocations, 0u) << name_of(s);
    EXPECT_GT(map[s].primitives, 0u) << name_of(s);
    EXPECT_EQ(shading_of(plain.work(s), 0)[Event::kShaderInvocations], 0u);
  }
  EXPECT_EQ(machine[Event::kShaderInvocations], 0u);
  // Vertices of post-position have no other attributes to shade, and blocks of whole vertices none to store, unless a
  // texture masks: the twin.
  EXPECT_EQ(map[SchemeId::kPostPosition].domain_evaluations, 0u);
  EXPECT_GT(with_mask[SchemeId::kPostPosition].domain_evaluations, 0u);
  EXPECT_LT(map[SchemeId::kPostTessellation].queue_bytes_written,
            with_mask[SchemeId::kPostTessellation].queue_bytes_written);
  EXPECT_GT(plain.passes.back().set[SchemeId::kPostPosition].domain_evaluations, 0u);
}

TEST(MapBaselines, TexelsTakeTheBytesOfTheirFormat) {
  const Observed wide = observe(floor_scene({}, true), {"shadows.format=d32f"}),
                 narrow = observe(floor_scene({}, true), {"shadows.format=d16"});
  const std::uint64_t texels = wide.result.passes.front().counters.shadows.texels_stored;
  ASSERT_GT(texels, 0u);
  for (const auto& [of, bytes] : {std::pair{&wide, std::uint64_t{4}}, {&narrow, std::uint64_t{2}}}) {
    const std::uint64_t flags =
        of->result.passes.front().counters.ledger.traffic(Unit::kResolve, Purpose::kShadowMap).written_bytes -
        texels * bytes;
    EXPECT_EQ(flags, 64u) << "a bit for each of 16 tiles";
    for (const SchemeId s : {SchemeId::kPostTessellation, SchemeId::kDeferredVertex, SchemeId::kControlList})
      EXPECT_EQ(of->passes.front().set[s].frame_bytes_written, texels * bytes + flags) << name_of(s);
    EXPECT_EQ(passes_stored_otherwise(*of), 0);
  }
}

// A cache that holds the map reads nothing of it and writes each touched line once; without one, every triangle reads
// and writes its lines.
TEST(MapBaselines, DepthsOfAnImmediateMachineMoveThroughItsCache) {
  const auto traffic = [](const char* bytes) {
    return observe(floor_scene({}, true), {bytes, "shadows.format=d32f"}).passes.front().set[SchemeId::kImmediate];
  };
  const BaselineCounters large = traffic("baselines.cache_bytes=1073741824"),
                         small = traffic("baselines.cache_bytes=1024"), none = traffic("baselines.cache_bytes=0");
  EXPECT_EQ(large.frame_bytes_read, 0u);
  EXPECT_GT(large.frame_bytes_written, 0u);
  EXPECT_LE(large.frame_bytes_written, 128u * 128 * 4);
  EXPECT_LT(large.frame_bytes_written, small.frame_bytes_written);
  EXPECT_LT(small.frame_bytes_read + small.frame_bytes_written, none.frame_bytes_read + none.frame_bytes_written);
  EXPECT_EQ(none.frame_bytes_read + none.frame_bytes_written + none.patch_bytes, none.dram_bytes_uncached);
  EXPECT_EQ(large.dram_bytes_uncached, none.dram_bytes_uncached) << "without a cache all are alike";
}

// Lookups of maps go through the texture caches: the same bytes for all schemes that shade only visible surfaces.
TEST(MapBaselines, LookupsAreTexturesToAll) {
  const Observed of = observe(floor_scene({}, true)), without = observe(floor_scene({}, true), {"effects.shadows=off"});
  const std::uint64_t bytes = of.result.counters.ledger.traffic(Unit::kTilecore, Purpose::kShadowMap).read_bytes;
  ASSERT_GT(bytes, 0u);
  const BaselineSet& view = of.passes.back().set;
  for (const SchemeId s : tiled(of, 1)) EXPECT_EQ(view[s].texture_bytes, bytes) << name_of(s);
  EXPECT_EQ(view[SchemeId::kTessera].texture_bytes, bytes);
  for (const SchemeId s : tiled(without, 0)) EXPECT_EQ(without.set[s].texture_bytes, 0u);
}

// ---- Frames of one pass, joined work, refusals ---------------------------------------------------------------------

TEST(OnePassBaselines, AreTheFrame) {
  const Observed of = observe(floor_scene({}));
  ASSERT_EQ(of.passes.size(), 1u);
  const PassGraph into_frame{{}, {drawing("frame")}};
  const Observed graph = observe(floor_scene(into_frame));
  EXPECT_EQ(baselines_json(graph.set), baselines_json(of.set));
  // The twin: a store of depths is noticed.
  PassGraph stores = into_frame;
  stores.passes[0].store = {{"depth", StoreAction::kStore}};
  EXPECT_NE(baselines_json(observe(floor_scene(stores)).set), baselines_json(of.set));
}

TEST(FrameWorkJoin, KeepsTheRoundsOfItsPasses) {  // FW1, FW2
  const Observed of = observe(floor_scene({}, true));
  for (const SchemeId s : triangle_schemes()) {
    const timing::FrameWork& frame = of.work(s);
    EXPECT_EQ(frame.passes.size(), 2u);
    baselines::FrameWorkJoin one, two;
    one.add(frame, "all", true);
    timing::FrameWork same = one.finish();
    EXPECT_EQ(same.dram_bytes(), frame.dram_bytes());
    EXPECT_EQ(same.rounds.size(), frame.rounds.size());
    EXPECT_EQ(same.tile_state_bytes, frame.tile_state_bytes);
    two.add(frame, "first", false);
    two.add(frame, "second", false);
    const timing::FrameWork twice = two.finish();
    EXPECT_EQ(twice.dram_bytes(), 2 * frame.dram_bytes());
    EXPECT_EQ(bytes_of(twice, 0), bytes_of(twice, 1));
    EXPECT_EQ(twice.rounds[frame.rounds.size()].geometry_after, 0u);
  }
  // Tiles keep the memory of their own pass: a map's texel takes 4 bytes, a sample of the frame 8.
  const timing::FrameWork& lists = of.work(SchemeId::kDeferredVertex);
  const gpu::GpuConfiguration gpu;
  const auto pixels = static_cast<std::uint64_t>(gpu.tile.width * gpu.tile.height);
  EXPECT_EQ(lists.tile_state_bytes, pixels * 4);
  EXPECT_EQ(lists.rounds.front().tiles.front().extra_bytes, 0u);
  EXPECT_EQ(lists.rounds.back().tiles.front().extra_bytes, pixels * 4 * 8 - pixels * 4);
}

std::string refusal_of(const scene::Capture& capture, const Keys& keys = {}) {
  try {
    observe(capture, keys);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(PassBaselineRefusals, AreOneLineEach) {
  scene::Capture glass = floor_scene({});
  for (scene::Material& material : glass.materials) {
    material.transmission.factor = 1;
    material.effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
  }
  Pass loads = drawing("frame");
  loads.load = {{"frame", LoadAction::kLoad}};
  const std::vector<std::pair<std::string, std::string>> refusals = {
      {refusal_of(floor_scene({}), {"shading.path=gbuffer_external"}), "gbuffer.layout=packed"},
      {refusal_of(floor_scene({}), {"tile.rendering_elimination=true"}), "tile.rendering_elimination=false"},
      {refusal_of(floor_scene(PassGraph{{}, {loads}}), {"frame_buffer.compression=lossless"}),
       "frame_buffer.compression=none"}};
  for (const auto& [found, expected] : refusals) {
    EXPECT_NE(found.find(expected), std::string::npos) << found;
    EXPECT_EQ(found.find('\n'), std::string::npos) << found;
  }
  EXPECT_EQ(refusal_of(floor_scene({}, true)), "") << "shadows are no reason";
  EXPECT_EQ(refusal_of(glass), "") << "nor are surfaces that transmit";
}

}  // namespace
}  // namespace tessera::replay::pass_baselines_test
