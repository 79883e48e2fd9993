// Passes that a capture describes (gpu/frame_graph.cpp, gpu/image_passes.cpp): their loads and stores by closed
// forms, unchanged images, and refusals, each with its place in the file.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/tests.h"

namespace tessera::gpu::frame_graph_test {
namespace {

using memory::Purpose;
using memory::Traffic;
using memory::Unit;
using scene::Attachment;
using scene::AttachmentFormat;
using scene::DrawFilter;
using scene::LoadAction;
using scene::Pass;
using scene::PassGraph;
using scene::PassShader;
using scene::StoreAction;
using scene::Subpass;
using test::attachment;
using test::bursts;
using test::by_way_of;
using test::copying;
using test::drawing;
using test::with_graph;
using Keys = std::vector<std::string>;

constexpr int kWidth = 100, kHeight = 70;  // no multiples of a tile
constexpr std::uint64_t kPixels = kWidth * kHeight;

// A slope of lit patches before a plain background; `glass` is a pane before it.
scene::Capture slope(bool glass = false) {
  scene::Capture capture;
  const int plain = test::add_material(capture, {});
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 8; ++x)
      test::add_node(capture, test::patches(test::flat_patch({-0.5, -0.15, 0}, {1, 0, 0.3}, {0, 0.3, 0.2}), plain),
                     DVec3(0.6 * (x - 3.5), 0.2 * (y - 7.5) + 0.1 * x, 0.1 * x));
  if (glass) {
    scene::Material pane;
    pane.transmission.factor = 1, pane.metallic = 0, pane.roughness = 0.2f;
    pane.effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
    test::add_node(
        capture, test::patches(test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), test::add_material(capture, pane)),
        DVec3(0, 0, 2));
  }
  capture.settings.background = Vec3(0.1f, 0.4f, 0.9f);
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 3, camera.y_mag = 2;
  test::add_camera(capture, {0, 0, 7}, camera);
  return capture;
}

struct Machine {
  RunSettings settings;
  GpuConfiguration gpu;
};
Machine machine_of(const Keys& keys) {
  Machine machine;
  apply_setting("frame_buffer.compression=none", machine.settings, machine.gpu);
  for (const std::string& key : keys) apply_setting(key, machine.settings, machine.gpu);
  return machine;
}

std::vector<FrameResult> frames_of(scene::Capture capture, std::optional<PassGraph> graph, const Keys& keys = {},
                                   int count = 1, int width = kWidth, int height = kHeight) {
  const Machine machine = machine_of(keys);
  capture = with_graph(std::move(capture), std::move(graph));
  Device device(capture, machine.gpu, machine.settings, {width, height, {0, 0, width, height}});
  std::vector<FrameResult> frames;
  for (int frame = 0; frame < count; ++frame) frames.push_back(device.render(frame));
  return frames;
}
FrameResult frame_of(scene::Capture capture, std::optional<PassGraph> graph, const Keys& keys = {}) {
  return std::move(frames_of(std::move(capture), std::move(graph), keys).front());
}

Traffic moved(const FrameCounters& counters, Unit unit, Purpose purpose) {
  return counters.ledger.traffic(unit, purpose);
}

bool same_image(const FrameResult& a, const FrameResult& b) { return a.targets.color.values == b.targets.color.values; }

TEST(FrameGraph, APassThatDrawsIntoTheFrameIsTheFrameWithoutPasses) {  // GRA1
  for (const bool glass : {false, true}) {
    const FrameResult plain = frame_of(slope(glass), {});
    Pass split = drawing("frame", DrawFilter::kOpaque);
    split.subpasses.push_back({DrawFilter::kBlended, PassShader::kForward, {}, {"frame"}, {}});
    for (const Pass& pass : {drawing("frame"), split}) {
      const FrameResult found = frame_of(slope(glass), PassGraph{{}, {pass}});
      EXPECT_TRUE(same_image(found, plain));
      EXPECT_EQ(found.counters.ledger.total().read_bytes, plain.counters.ledger.total().read_bytes);
      EXPECT_EQ(found.counters.ledger.total().written_bytes, plain.counters.ledger.total().written_bytes);
      EXPECT_EQ(found.model->timing.cycles, plain.model->timing.cycles);
      EXPECT_EQ(found.passes.back().name, "draw");
      ASSERT_EQ(found.passes.size(), plain.passes.size());
    }
  }
}

TEST(FrameGraph, LoadsAndStoresChangeBytesAlone) {  // GRA2, GRA3
  for (const char* samples : {"sampling.samples_per_pixel=1", "sampling.samples_per_pixel=4"}) {
    const std::uint64_t spp = samples[std::strlen(samples) - 1] == '1' ? 1 : 4;
    for (const bool glass : {false, true})
      for (const auto& [store, depths] : {std::pair{StoreAction::kStore, spp}, {StoreAction::kResolve, 1}}) {
        const FrameResult plain = frame_of(slope(glass), {}, {samples});
        Pass pass = drawing("frame");
        pass.load = {{"frame", LoadAction::kLoad}};
        pass.store = {{"depth", store}};
        const FrameResult found = frame_of(slope(glass), PassGraph{{}, {pass}}, {samples});
        EXPECT_TRUE(same_image(found, plain));
        EXPECT_EQ(moved(found.counters, Unit::kResolve, Purpose::kAttachment).written_bytes,
                  bursts(4 * depths * kPixels));
        EXPECT_EQ(moved(found.counters, Unit::kTilecore, Purpose::kFrameBuffer).read_bytes,
                  moved(plain.counters, Unit::kResolve, Purpose::kFrameBuffer).written_bytes)
            << "tiles are loaded from the place where they are stored";
        EXPECT_GT(found.model->timing.cycles, plain.model->timing.cycles);
      }
  }
}

// Without its load and store the same test must fail.
TEST(FrameGraph, WithoutActionsNothingOfThemMoves) {
  const FrameResult found = frame_of(slope(), PassGraph{{}, {drawing("frame")}});
  EXPECT_EQ(moved(found.counters, Unit::kResolve, Purpose::kAttachment).written_bytes, 0u);
  EXPECT_EQ(moved(found.counters, Unit::kTilecore, Purpose::kFrameBuffer).read_bytes, 0u);
}

// Known answer: Arm's sample of render passes, 2220x1080 at 60 Hz. On a Mali-G71 clearing the colours instead of loading
// them saves 600.2 MiB/s (629.4 MB/s), and not storing depths 554.8 MiB/s (581.7 MB/s).
TEST(FrameGraph, LoadsAndStoresOfArmsSampleMoveTheBytesOfTheClosedForm) {
  Pass pass = drawing("frame");
  pass.load = {{"frame", LoadAction::kLoad}};
  pass.store = {{"depth", StoreAction::kStore}};
  const Keys keys = {"sampling.samples_per_pixel=1"};
  const auto render = [&](std::optional<PassGraph> graph) {
    return std::move(frames_of(slope(), std::move(graph), keys, 1, 2220, 1080).front());
  };
  const FrameResult both = render(PassGraph{{}, {pass}}), neither = render({});
  const std::uint64_t load = both.counters.ledger.total().read_bytes - neither.counters.ledger.total().read_bytes,
                      store =
                          both.counters.ledger.total().written_bytes - neither.counters.ledger.total().written_bytes;
  EXPECT_EQ(store, 9590400u);
  // Rows of 2220 pixels begin at bursts of 64 bytes: 139 of them hold a row.
  EXPECT_EQ(load, 139u * 64 * 1080);
  EXPECT_NEAR(static_cast<double>(load) * 60e-6, 575.4, 0.002 * 575.4);
  EXPECT_NEAR(575.4 / 629.4, 1.0, 0.1);
  EXPECT_NEAR(575.4 / 581.7, 1.0, 0.1);
}

// A compressed frame is loaded as it lies in memory: nothing but headers at first, then the bytes that the previous
// frame stored.
TEST(FrameGraph, ALoadOfACompressedFrameReadsTheStoredBytes) {
  for (const bool copies : {false, true}) {
    PassGraph graph = copies ? by_way_of(AttachmentFormat::kRgba8) : PassGraph{{}, {drawing("frame")}};
    graph.passes.back().load = {{"frame", LoadAction::kLoad}};
    const std::vector<FrameResult> frames = frames_of(slope(), graph, {"frame_buffer.compression=lossless"}, 2);
    const std::uint64_t headers = bursts(((kWidth + 7) / 8) * ((kHeight + 7) / 8));
    const auto read = [&](std::size_t frame) {
      return moved(frames[frame].counters, Unit::kTilecore, Purpose::kFrameBuffer).read_bytes;
    };
    EXPECT_EQ(read(0), headers);
    EXPECT_EQ(read(1), moved(frames[0].counters, Unit::kResolve, Purpose::kFrameBuffer).written_bytes);
    EXPECT_GT(read(1), headers);
  }
}

TEST(FrameGraph, CopiesMoveAnAttachmentOnceEachWay) {  // GRA3
  for (const bool glass : {false, true})
    for (const auto& [format, bytes] :
         {std::pair{AttachmentFormat::kRgba8, 4}, {AttachmentFormat::kRgb10A2, 4}, {AttachmentFormat::kRgba16F, 8}}) {
      const FrameResult plain = frame_of(slope(glass), {}), found = frame_of(slope(glass), by_way_of(format));
      const std::uint64_t all = bursts(static_cast<std::uint64_t>(bytes) * kPixels);
      EXPECT_EQ(moved(found.counters, Unit::kResolve, Purpose::kAttachment).written_bytes, all);
      EXPECT_EQ(moved(found.counters, Unit::kTilecore, Purpose::kAttachment).read_bytes, all);
      EXPECT_EQ(moved(found.counters, Unit::kResolve, Purpose::kFrameBuffer).written_bytes,
                moved(plain.counters, Unit::kResolve, Purpose::kFrameBuffer).written_bytes);
      ASSERT_EQ(found.passes.size(), plain.passes.size() + 1);
      const FrameCounters& last = found.passes.back().counters;
      EXPECT_EQ(found.passes.back().name, "final");
      EXPECT_EQ(moved(last, Unit::kTilecore, Purpose::kAttachment).read_bytes, all);
      EXPECT_EQ(moved(last, Unit::kResolve, Purpose::kAttachment).written_bytes, 0u);
      EXPECT_EQ(last.shading.pixel_shader_invocations, 0u);
      std::uint64_t pixels = 0;
      for (const timing::TileWork& tile : found.model->record.work.rounds.back().tiles)
        pixels += tile.events[hardware::Event::kPixels];
      EXPECT_EQ(pixels, kPixels);
      EXPECT_GT(found.model->timing.cycles, plain.model->timing.cycles);
    }
}

// A copied frame holds the colours as the attachment's format rounds them, by the rule of the format itself.
TEST(FrameGraph, AnAttachmentRoundsColorsToItsFormat) {
  const FrameResult plain = frame_of(slope(), {});
  for (const auto& [format, stored] : {std::pair{AttachmentFormat::kRgba8, tilecore::FrameFormat::kRgba8},
                                       {AttachmentFormat::kRgba16F, tilecore::FrameFormat::kRgba16f}}) {
    const FrameResult found = frame_of(slope(), by_way_of(format));
    const tilecore::PixelCoder coder(stored);
    bool same = true, changed = false;
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      const float *was = &plain.targets.color.values[4 * pixel], *is = &found.targets.color.values[4 * pixel];
      Vec4 expected(was[0], was[1], was[2], was[3]);
      coder.stored({&expected, 1}, &expected);
      for (int c = 0; c < 4; ++c) same = same && is[c] == expected[c], changed = changed || is[c] != was[c];
    }
    EXPECT_TRUE(same);
    EXPECT_TRUE(changed);
  }
}

// Every sample is stored and loaded again, and the resolve unit passes each of them.
TEST(FrameGraph, APassOfItsOwnResolvesStoredSamples) {  // GRA3
  for (const bool glass : {false, true})
    for (const int samples : {1, 2, 4, 8}) {
      const Keys keys = {"sampling.samples_per_pixel=" + std::to_string(samples)};
      for (const AttachmentFormat format :
           {AttachmentFormat::kRgba8, AttachmentFormat::kRgb10A2, AttachmentFormat::kRgba16F}) {
        PassGraph graph = by_way_of(format);
        const FrameResult on_chip = frame_of(slope(glass), graph, keys);
        graph.passes[0].store = {{"lit", StoreAction::kStore}};
        const FrameResult apart = frame_of(slope(glass), graph, keys);
        const std::uint64_t all = bursts(static_cast<std::uint64_t>(sample_bits(format) / 8 * samples) * kPixels);
        EXPECT_EQ(moved(apart.counters, Unit::kResolve, Purpose::kAttachment).written_bytes, all);
        EXPECT_EQ(moved(apart.counters, Unit::kTilecore, Purpose::kAttachment).read_bytes, all);
        if (samples == 1) {
          EXPECT_TRUE(same_image(apart, on_chip));
          EXPECT_EQ(apart.model->timing.cycles, on_chip.model->timing.cycles);
          continue;
        }
        EXPECT_GT(apart.model->timing.cycles, on_chip.model->timing.cycles);
        EXPECT_GT(apart.model->energy.total_nj(), on_chip.model->energy.total_nj());
        // Half floats round a sample by at most 2^-11 of it. Eight bits hold tone-mapped samples, whose mean is another
        // colour than the tone-mapped mean where an edge crosses a pixel.
        if (format == AttachmentFormat::kRgba16F)
          for (std::size_t i = 0; i < apart.targets.color.values.size(); ++i)
            EXPECT_NEAR(apart.targets.color.values[i], on_chip.targets.color.values[i],
                        on_chip.targets.color.values[i] * 0x1p-9f + 1e-6f);
        else
          EXPECT_FALSE(same_image(apart, on_chip));
      }
    }
}

// Known answer: Arm's sample of MSAA, 2168x1080 with four samples of 4 bytes at 60 Hz. A pass of its own that resolves moves
// 2143.7 MiB/s more each way than the resolve on write-back; on a Mali-G76 it reads 2169.8 MiB/s more and writes 2282.0.
TEST(FrameGraph, SeparateResolvesOfArmsSampleMoveTheBytesOfTheClosedForm) {
  PassGraph graph = by_way_of(AttachmentFormat::kRgba8);
  const auto render = [&](const PassGraph& g) {
    return std::move(frames_of(slope(), g, {"sampling.samples_per_pixel=4"}, 1, 2168, 1080).front());
  };
  const FrameResult on_chip = render(PassGraph{{}, {drawing("frame")}});
  graph.passes[0].store = {{"lit", StoreAction::kStore}};
  const FrameResult apart = render(graph);
  const memory::Traffic before = on_chip.counters.ledger.total(), after = apart.counters.ledger.total();
  const std::uint64_t bytes = std::uint64_t{2168} * 1080 * 4 * 4;
  EXPECT_EQ(after.read_bytes - before.read_bytes, bytes);
  EXPECT_EQ(after.written_bytes - before.written_bytes, bytes);
  const double mebibytes = static_cast<double>(bytes) * 60 / 0x1p20;
  EXPECT_NEAR(mebibytes, 2143.7, 0.05);
  EXPECT_NEAR(mebibytes / 2169.8, 1, 0.15);
  EXPECT_NEAR(mebibytes / 2282.0, 1, 0.15);
}

// The same sample with a pass behind that reads the colours, and depths kept for it: 2143.7 MiB/s more are read and 3751.5
// written; the Mali-G76 reads 2366.4 MiB/s more and writes 3950.9. Written are four colours and four depths of 4 bytes and
// the resolved colour, instead of one colour and one depth.
TEST(FrameGraph, SeparateResolvesBeforeAPostPassMoveTheBytesOfTheClosedForm) {
  const auto render = [&](const PassGraph& g) {
    return std::move(frames_of(slope(), g, {"sampling.samples_per_pixel=4"}, 1, 2168, 1080).front());
  };
  PassGraph on_chip = by_way_of(AttachmentFormat::kRgba8), apart = on_chip;
  on_chip.passes[0].store = {{"depth", StoreAction::kResolve}};
  apart.attachments.push_back(attachment("resolved", AttachmentFormat::kRgba8));
  apart.passes = {drawing("lit"), copying("resolve", "lit", "resolved"), copying("post", "resolved", "frame")};
  apart.passes[0].store = {{"lit", StoreAction::kStore}, {"depth", StoreAction::kStore}};
  const FrameResult one = render(on_chip), two = render(apart);
  const memory::Traffic before = one.counters.ledger.total(), after = two.counters.ledger.total();
  const std::uint64_t pixels = std::uint64_t{2168} * 1080;
  EXPECT_EQ(after.read_bytes - before.read_bytes, pixels * 4 * 4);
  EXPECT_EQ(after.written_bytes - before.written_bytes, pixels * 4 * (4 + 4 + 1 - 1 - 1));
  EXPECT_NEAR(static_cast<double>(after.written_bytes - before.written_bytes) * 60 / 0x1p20, 3751.5, 0.2)
      << "the published sum is made of rounded parts";
  EXPECT_NEAR(2143.7 / (3527.0 - 1160.6), 1, 0.15);
  EXPECT_NEAR(3751.5 / (4881.6 - 930.7), 1, 0.15);
}

TEST(FrameGraph, ChainsOfCopiesAndPartialRendersKeepImagesAndBytes) {
  PassGraph chain = by_way_of(AttachmentFormat::kRgba16F);
  chain.attachments.push_back(attachment("again", AttachmentFormat::kRgba16F));
  chain.passes = {copying("final", "again", "frame"), drawing("lit"), copying("second", "lit", "again")};
  const FrameResult once = frame_of(slope(), by_way_of(AttachmentFormat::kRgba16F)), twice = frame_of(slope(), chain);
  EXPECT_TRUE(same_image(once, twice)) << "half floats are half floats";
  EXPECT_EQ(twice.passes.back().name, "final");
  EXPECT_EQ(moved(twice.counters, Unit::kTilecore, Purpose::kAttachment).read_bytes, 2 * bursts(8 * kPixels));
  const FrameResult part =
      frame_of(slope(), chain,
               {"parameter_buffer.bytes=2048", "tessellator.sub_patch_cells=4", "tile.width=16", "tile.height=16"});
  EXPECT_GT(part.counters.binner.partial_renders, 0u);
  EXPECT_TRUE(same_image(part, once));
  EXPECT_EQ(moved(part.counters, Unit::kTilecore, Purpose::kAttachment).read_bytes, 2 * bursts(8 * kPixels));
  EXPECT_EQ(moved(part.counters, Unit::kResolve, Purpose::kAttachment).written_bytes, 2 * bursts(8 * kPixels));
}

// Unchanged tiles are not copied again, and the images equal those without elimination.
TEST(FrameGraph, EliminationLeavesCopiesOut) {
  const PassGraph graph = by_way_of(AttachmentFormat::kRgba8);
  const std::vector<FrameResult> plain = frames_of(slope(), graph, {}, 2);
  for (const char* key : {"tile.rendering_elimination=true", "frame_buffer.transaction_elimination=true"}) {
    const std::vector<FrameResult> found = frames_of(slope(), graph, {key}, 2);
    EXPECT_TRUE(same_image(found[0], plain[0])) << key;
    EXPECT_TRUE(same_image(found[1], plain[1])) << key;
    EXPECT_EQ(moved(found[1].counters, Unit::kResolve, Purpose::kFrameBuffer).written_bytes, 0u) << key;
    const bool rendered = std::string_view(key).starts_with("frame_buffer");
    EXPECT_EQ(moved(found[1].counters, Unit::kTilecore, Purpose::kAttachment).read_bytes,
              rendered ? bursts(4 * kPixels) : 0u)
        << key;
  }
}

Pass depths() {
  Pass pass;
  pass.name = "depths";
  pass.subpasses = {{DrawFilter::kAll, PassShader::kDepth, {}, {}, {}}};
  return pass;
}
// The first pass leaves parameters of surfaces in two attachments and, on chip, lights them into `lit`.
void gbuffer(PassGraph& graph, bool lights) {
  for (const char* name : {"a", "b"}) graph.attachments.push_back(attachment(name, AttachmentFormat::kRgba16F));
  Pass& pass = graph.passes[0];
  pass.lists_subpasses = lights;
  pass.subpasses = {{DrawFilter::kAll, PassShader::kGbuffer, {}, {"a", "b"}, {}}};
  if (lights) pass.subpasses.push_back({DrawFilter::kNothing, PassShader::kLight, {"a", "b", "depth"}, {"lit"}, {}});
}

struct Refused {
  const char* name;
  std::function<void(PassGraph&)> change;
  const char* says;
  Keys keys{};
};

const std::vector<Refused> kRefused = {
    {"NarrowGbuffer", [](PassGraph& g) { g.passes[0].subpasses[0].shader = PassShader::kGbuffer; },
     "/passes/0/write: have 64 bits a sample: material and normal of a lit surface take 96"},
    {"GbufferWithoutLight", [](PassGraph& g) { gbuffer(g, false); }, "/passes/1: runs before a pass has left colours"},
    {"GbufferLeavesOut",
     [](PassGraph& g) {
       gbuffer(g, true);
       g.passes[0].subpasses[0].draw = DrawFilter::kOpaque;
     },
     "/passes/0/subpasses/0/draw: leaves surfaces out: draw all, or opaque and then blended ones"},
    {"LightReadsAPart",
     [](PassGraph& g) {
       gbuffer(g, true);
       g.passes[0].subpasses[1].input = {"a", "depth"};
     },
     "/passes/0/subpasses/1/input: is not the G-buffer and 'depth': light reads all of it"},
    {"StoredThoughLit",
     [](PassGraph& g) {
       gbuffer(g, true);
       g.passes[0].store = {{"a", StoreAction::kStore}};
     },
     "/passes/0/store/a: is stored, though this pass lights it"},
    {"DropsSamples",
     [](PassGraph& g) {
       gbuffer(g, false);
       g.passes[0].store = {{"a", StoreAction::kResolve}};
     },
     "/passes/0/store/a: drops samples that a later pass lights"},
    {"DepthsOfBlended",
     [](PassGraph& g) {
       g.passes.insert(g.passes.begin(), depths());
       g.passes[0].subpasses[0].draw = DrawFilter::kBlended;
     },
     "/passes/0/draw: is blended: depths that hide are those of opaque surfaces"},
    {"DepthsNotLoaded", [](PassGraph& g) { g.passes.insert(g.passes.begin(), depths()); },
     "/passes/1/load/depth: does not load the depths of the pass before"},
    {"Shader",
     [](PassGraph& g) {
       g.passes[0].subpasses.push_back({DrawFilter::kNothing, PassShader::kCopy, {"lit"}, {"lit"}, {}});
     },
     "/passes/0/shader: is copy: a pass that draws colours runs forward on this machine"},
    {"Bloom", [](PassGraph& g) { g.passes[1].subpasses[0].shader = PassShader::kBloom; },
     "/passes/1/write: is not one attachment of its own"},
    {"Reduce", [](PassGraph& g) { g.passes[1].subpasses[0].shader = PassShader::kReduce; },
     "/passes/1/shader: is reduce: a pass over an image runs taa, bloom, tonemap or copy on this machine"},
    {"SecondDraw", [](PassGraph& g) { g.passes[1] = drawing("frame"), g.passes[1].name = "more"; },
     "/passes/1: draws after another pass has drawn"},
    {"RightEye", [](PassGraph& g) { g.passes[0].view = scene::PassView::kRight; },
     "/passes/0/view: is right: stereo.eye_separation renders both eyes"},
    {"Filter", [](PassGraph& g) { g.passes[0].subpasses[0].draw = DrawFilter::kOpaque; },
     "/passes/0/draw: leaves surfaces out"},
    {"DepthNotCleared",
     [](PassGraph& g) {
       g.passes[0].load = {{"depth", LoadAction::kLoad}};
     },
     "/passes/0/load/depth: does not clear the depths: the frame would be another one"},
    {"Format", [](PassGraph& g) { g.attachments[0].format = AttachmentFormat::kR11G11B10F; },
     "/passes/0/write: is 'lit' with r11g11b10f: this machine stores colours as rgba8, rgb10a2 or rgba16f"},
    {"Size",
     [](PassGraph& g) {
       g.attachments[0].scale = 0.5, g.passes[0].subpasses[0].write.push_back("z"),
       g.attachments.push_back(attachment("z", AttachmentFormat::kD16)), g.attachments[1].scale = 0.5;
     },
     "/passes/0/write: is 'lit', which has another size than the frame"},
    {"BloomOfSamples",
     [](PassGraph& g) {
       g.passes[0].store = {{"lit", StoreAction::kStore}};
       g.attachments.push_back(attachment("glow", AttachmentFormat::kRgba16F));
       Pass bloom = copying("bloom", "lit", "glow");
       bloom.subpasses[0].shader = PassShader::kBloom;
       g.passes.insert(g.passes.begin() + 1, bloom);
     },
     "/passes/1/sample: is 'lit', which keeps 4 samples a pixel: a bloom reads resolved colours"},
    {"TwoColors",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("more", AttachmentFormat::kRgba8)),
           g.passes[0].subpasses[0].write.push_back("more");
     },
     "/passes/0/write: are several colours: this machine renders one"},
    {"FrameFirst",
     [](PassGraph& g) {
       g.passes[0] = drawing("frame"), g.passes[1].subpasses[0].sample = {"frame"},
       g.passes[1].subpasses[0].write = {"lit"};
     },
     "/passes/0/write: is 'frame' before the last pass"},
    {"NoTile",
     [](PassGraph&) {},
     "/passes/0: needs 12 bytes of tile memory a sample: a tile of 64x64 pixels with 16 samples takes 786432, "
     "tilecore.memory_bytes is ",
     {"tile.width=64", "tile.height=64", "sampling.samples_per_pixel=16"}},
};

class RefusedGraph : public testing::TestWithParam<Refused> {};

TEST_P(RefusedGraph, IsOneLineWithItsPlace) {
  scene::Capture capture = slope();
  capture.file = "some.glb";
  capture.settings.graph = by_way_of(AttachmentFormat::kRgba16F);
  GetParam().change(*capture.settings.graph);
  const Machine machine = machine_of(GetParam().keys);
  try {
    const FrameGraph graph(capture, machine.gpu, machine.settings, {0, 0, kWidth, kHeight}, {kWidth, kHeight});
    FAIL() << "not refused";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_THAT(text, testing::StartsWith(std::string("some.glb: /extensions/TESSERA_capture") + GetParam().says));
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}
INSTANTIATE_TEST_SUITE_P(All, RefusedGraph, testing::ValuesIn(kRefused),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(FrameGraph, SettingsThatDoNotFitAreRefused) {
  scene::Capture capture = slope();
  capture.settings.graph = by_way_of(AttachmentFormat::kRgba8);
  const auto device = [&](const Keys& keys) {
    const Machine machine = machine_of(keys);
    return Device(capture, machine.gpu, machine.settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  };
  EXPECT_THROW(device({"resolve.desampling=adaptive"}), UsageError);
  struct Nobody final : ViewObserver {
    void view_rendered(const RenderedView&) override {}
  } nobody;
  EXPECT_NO_THROW(device({}).set_observer(&nobody));
  capture.settings.graph = PassGraph{{}, {drawing("frame")}};
  EXPECT_NO_THROW(device({"resolve.desampling=adaptive"}).set_observer(&nobody));
  capture.settings.graph->passes[0].load = {{"frame", LoadAction::kLoad}};
  EXPECT_NO_THROW(device({}).set_observer(&nobody));
  EXPECT_THROW(device({"frame_buffer.compression=lossless"}).set_observer(&nobody), UsageError);
}

}  // namespace
}  // namespace tessera::gpu::frame_graph_test
