// Texels that passes store beside colours (gpu/stored_arrays.h): depths, velocities, G-buffers, histories and levels of a
// bloom, compressed and with signatures, by closed forms and against raw storage.
#include "gpu/stored_arrays.h"
#include "tests/support/tile_squares.h"

namespace tessera::gpu::stored_arrays_test {
namespace {

using memory::Purpose;
using memory::Traffic;
using memory::Unit;
using scene::AttachmentFormat;
using scene::PassGraph;
using scene::PassShader;
using scene::StoreAction;
using test::bursts;
using test::tiled::Asked;
using test::tiled::bursts_moved;
using test::tiled::frames_of;
using test::tiled::kCompressed;
using test::tiled::kPixels;
using test::tiled::kRaw;
using test::tiled::kRendering;
using test::tiled::kTilePixels;
using test::tiled::kTiles;
using test::tiled::kTransactions;
using test::tiled::loaded;
using test::tiled::nothing;
using test::tiled::same_image;
using test::tiled::squares;
using test::tiled::stored;
using Keys = std::vector<std::string>;

constexpr std::uint64_t kSamples = 4;
const Keys kSampled = {"sampling.samples_per_pixel=4"};

// The frame alone.
PassGraph plain() { return {{}, {test::drawing("frame")}}; }
// The depths of the drawing pass are stored, of one sample or of all.
PassGraph storing_depths(AttachmentFormat format, StoreAction store) {
  PassGraph graph = plain();
  graph.attachments.push_back(test::attachment("far", format));
  graph.passes[0].subpasses[0].write.push_back("far");
  graph.passes[0].store = {{"far", store}};
  return graph;
}
PassGraph blooming(AttachmentFormat format, int levels) {
  return {{test::attachment("lit", AttachmentFormat::kRgba16F), test::attachment("glow", format, 0.5, levels)},
          {test::drawing("lit"), test::over_image("bloom", PassShader::kBloom, {"lit"}, "glow"),
           test::over_image("final", PassShader::kTonemap, {"lit", "glow"}, "frame")}};
}

struct Kind {
  std::string name;
  PassGraph graph;
  Keys keys;
  std::uint64_t pixel_bytes;  // that it stores beside colours, raw
  std::uint64_t arrays;       // signatures of a tile
  bool loads = true;          // the same frame loads all of it
};
std::vector<Kind> kinds() {
  const auto with = [](Keys keys) {
    keys.insert(keys.end(), kSampled.begin(), kSampled.end());
    return keys;
  };
  return {{"prepass", plain(), with({"shading.path=prepass"}), 4 * kSamples, 1},
          {"exact", plain(), with({"shading.path=gbuffer_external", "gbuffer.layout=exact"}), 64 * kSamples, 1},
          {"packed", plain(), with({"shading.path=gbuffer_external", "gbuffer.layout=packed"}), 20 * kSamples, 2},
          {"wide", plain(), with({"shading.path=gbuffer_external", "gbuffer.layout=packed", "gbuffer.bits=192"}),
           28 * kSamples, 2},
          {"d32f", storing_depths(AttachmentFormat::kD32F, StoreAction::kStore), kSampled, 4 * kSamples, 1, false},
          {"d24", storing_depths(AttachmentFormat::kD24, StoreAction::kResolve), kSampled, 4, 1, false},
          {"d16", storing_depths(AttachmentFormat::kD16, StoreAction::kStore), kSampled, 2 * kSamples, 1, false}};
}

Keys plus(Keys keys, const Keys& more) {
  keys.insert(keys.end(), more.begin(), more.end());
  return keys;
}
FrameResult frame_of(const scene::Capture& capture, const Kind& kind, const Keys& keys, const Asked& run = {}) {
  return std::move(frames_of(capture, kind.graph, plus(kind.keys, keys), run).front());
}

// ---- Compression -----------------------------------------------------------------------------------------------------

TEST(StoredArrays, CompressionMovesLessAndKeepsTheImage) {  // SA1, SA2
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    const FrameResult raw = frame_of(squares(true, false), kind, {kRaw}),
                      packed = frame_of(squares(true, false), kind, {kCompressed});
    EXPECT_TRUE(same_image(raw, packed));
    EXPECT_EQ(stored(raw.counters), kind.pixel_bytes * kPixels);
    EXPECT_EQ(loaded(raw.counters), kind.loads ? stored(raw.counters) : 0);
    EXPECT_LT(stored(packed.counters), stored(raw.counters));
    EXPECT_EQ(loaded(packed.counters), kind.loads ? stored(packed.counters) : 0);
    EXPECT_EQ(raw.counters.store.pixels_compressed, 0u);
    EXPECT_GT(packed.counters.store.pixels_compressed, kSamples * kPixels / 4);
    EXPECT_EQ(packed.counters.store.pixels_decompressed > 0, kind.loads);
    EXPECT_LT(packed.model->energy.total_nj(), raw.model->energy.total_nj());
  }
}

// Without surfaces all is as a clear leaves it: a header of a byte for each block of 8x8 pixels, sample and plane.
TEST(StoredArrays, AClearedArrayMovesHeadersAlone) {
  const std::map<std::string, std::uint64_t> planes = {
      {"prepass", kSamples}, {"exact", 16 * kSamples}, {"d32f", kSamples}, {"d24", 1}, {"d16", kSamples}};
  for (const Kind& kind : kinds()) {
    if (!planes.contains(kind.name)) continue;
    const FrameResult found = frame_of(nothing(), kind, {kCompressed});
    EXPECT_EQ(stored(found.counters), bursts(planes.at(kind.name) * kPixels / 64)) << kind.name;
    EXPECT_EQ(found.counters.store.pixels_decompressed, 0u) << kind.name;
  }
  // The packed G-buffer has headers for depths and for its four words; two words that are not known stay raw.
  const std::uint64_t depths = bursts(kSamples * kPixels / 64);
  for (const Kind& kind : kinds()) {
    const FrameResult found = frame_of(nothing(), kind, {kCompressed});
    if (kind.name == "packed") {
      EXPECT_EQ(stored(found.counters), depths + bursts(4 * kSamples * kPixels / 64));
    }
    if (kind.name == "wide") {
      EXPECT_EQ(stored(found.counters), depths + 8 * kSamples * kPixels + bursts(6 * kSamples * kPixels / 64));
    }
  }
}

TEST(StoredArrays, NoBurstBelongsToTwoArrays) {
  for (const Kind& kind : kinds())
    for (const std::string& key : {kRaw, kCompressed})
      for (const auto& [width, height] : {std::pair{test::tiled::kWidth, test::tiled::kHeight}, {100, 70}}) {
        const Asked run{{0}, width, height, true};
        const auto [written, read] = bursts_moved(frame_of(squares(true, false), kind, {key}, run));
        EXPECT_FALSE(written.empty());
        EXPECT_EQ(read, kind.loads ? written : decltype(read){}) << kind.name << key;
        for (const auto& [burst, times] : written) EXPECT_EQ(times, 1) << kind.name << key << burst;
      }
}

// Frames and regions that cut blocks, bursts of all sizes, any number of samples: the bytes are loaded as they were stored,
// and no array takes more than its raw texels and headers, each in whole bursts.
TEST(StoredArrays, AnyBurstRegionAndSamplesKeepTheImage) {
  const std::vector<Asked> runs = {{{0}, 100, 70}, {{0}, 96, 64, false, {5, 3, 78, 51}}, {{0}, 37, 9}};
  for (const Kind& kind : kinds())
    for (const Asked& run : runs)
      for (const Keys& more : {Keys{}, Keys{"memory.burst_bytes=16"}, Keys{"memory.burst_bytes=256"},
                               Keys{"sampling.samples_per_pixel=16"}}) {
        SCOPED_TRACE(kind.name + (more.empty() ? "" : more[0]));
        const FrameResult raw = frame_of(squares(true, false), kind, plus(more, {kRaw}), run),
                          packed = frame_of(squares(true, false), kind, plus(more, {kCompressed}), run);
        EXPECT_TRUE(same_image(raw, packed));
        EXPECT_EQ(loaded(packed.counters), kind.loads ? stored(packed.counters) : 0);
        // A header of a byte for at least 64 bytes, and a partly used burst at the end of each row of blocks of a tile.
        EXPECT_LT(stored(packed.counters), stored(raw.counters) * 5 / 4 + 4096);
        EXPECT_GT(stored(packed.counters), 0u);
      }
}

// Words of which nothing is known are stored raw: blocks that the frame cuts take their rows alone.
TEST(StoredArrays, CutBlocksTakeTheirRowsAlone) {
  Kind wide = kinds()[3];
  const Asked run{{0}, 96, 70};
  const auto bits = [&](const char* count) {
    wide.keys.back() = std::string("gbuffer.bits=") + count;
    return stored(frame_of(squares(true, false), wide, {kCompressed, "sampling.samples_per_pixel=1"}, run).counters);
  };
  wide.keys = {"shading.path=gbuffer_external", "gbuffer.layout=packed", "gbuffer.bits=128"};
  // 8 bytes a pixel in 2 planes, whose last rows of blocks hold 6 rows of 32 bytes, and headers.
  const std::uint64_t blocks = 96 / 8 * 9;
  const std::uint64_t narrow = bits("128");
  EXPECT_EQ(bits("192") - narrow, 8 * 96 * 70 + bursts(6 * blocks) - bursts(4 * blocks));
}

// A depth that the capture stores beside a G-buffer in memory takes what it takes on other paths.
TEST(StoredArrays, ADepthIsStoredOnEveryPath) {
  for (const AttachmentFormat format : {AttachmentFormat::kD32F, AttachmentFormat::kD16})
    for (const StoreAction store : {StoreAction::kStore, StoreAction::kResolve}) {
      const auto bytes = [&](const PassGraph& graph, const std::string& path) {
        return stored(frames_of(squares(true, false), graph, plus(kSampled, {kCompressed, "shading.path=" + path}))
                          .front()
                          .counters);
      };
      const std::uint64_t alone = bytes(storing_depths(format, store), "visibility");
      EXPECT_GT(alone, kPixels / 64);
      for (const char* path : {"gbuffer", "gbuffer_external"})
        EXPECT_EQ(bytes(storing_depths(format, store), path) - bytes(plain(), path), alone) << path;
    }
}

// Lists that do not fit leave rounds behind; the arrays are stored and loaded once all the same.
TEST(StoredArrays, PartialRendersStoreOnce) {
  for (const Kind& kind : kinds()) {
    const FrameResult whole = frame_of(squares(true, false), kind, {kCompressed}),
                      parts = frame_of(squares(true, false), kind, {kCompressed, "parameter_buffer.bytes=1152"});
    EXPECT_GT(parts.counters.binner.partial_renders, 0u) << kind.name;
    EXPECT_TRUE(same_image(whole, parts)) << kind.name;
    EXPECT_EQ(stored(parts.counters), stored(whole.counters)) << kind.name;
    // Tiles that begin in different rounds read a burst of headers once each.
    EXPECT_GE(loaded(parts.counters), loaded(whole.counters)) << kind.name;
    EXPECT_LE(loaded(parts.counters), loaded(whole.counters) + 64 * kTiles) << kind.name;
  }
}

// Samples of rgba16f whose colours differ a little in both directions take little: a difference is a number, not a half.
TEST(StoredArrays, SmallDifferencesOfSamplesTakeLittle) {
  constexpr int kSide = 16;
  tilecore::FrameStore store;
  store.coder = tilecore::PixelCoder(tilecore::FrameFormat::kRgba16f, 1);
  store.compressed = store.by_tile = true, store.samples = 2;
  std::vector<Vec3> color;
  std::vector<float> coverage(std::size_t{2 * kSide * kSide}, 1.0f);
  for (int pixel = 0; pixel < kSide * kSide; ++pixel) {
    color.emplace_back(1.0f);
    color.emplace_back(1.0f + static_cast<float>(pixel % 3 - 1) / 512);
  }
  tilecore::TileStore unit;
  Image image(kSide, kSide, 4);
  memory::Ledger ledger;
  unit.round(store.coder, color, coverage, true);
  unit.store_attachment(store, {.pixels = {0, 0, kSide, kSide}, .region = {0, 0, kSide, kSide}}, image, ledger);
  // Eight blocks of a burst for the first samples, and three channels of residuals of 4 bits at most for the second.
  EXPECT_LE(ledger.total().written_bytes, 8u * 64u + 8u * 128u);
}

// ---- Signatures ------------------------------------------------------------------------------------------------------

TEST(StoredArrays, AStillArrayIsStoredOnce) {  // SA3
  for (const Kind& kind : kinds())
    for (const std::string& key : {kRaw, kCompressed}) {
      SCOPED_TRACE(kind.name + key);
      const Asked run{{0, 1, 2, 7}};
      const auto all = frames_of(squares(true, false), kind.graph, plus(kind.keys, {key}), run),
                 found = frames_of(squares(true, false), kind.graph, plus(kind.keys, {key, kTransactions}), run);
      for (std::size_t f = 0; f < found.size(); ++f) {
        EXPECT_TRUE(same_image(found[f], all[f]));
        EXPECT_EQ(found[f].counters.store.wrong_matches, 0u);
        EXPECT_EQ(loaded(found[f].counters), loaded(all[f].counters));
        const bool known = f == 1 || f == 2;  // frame 7 does not follow frame 2
        EXPECT_EQ(stored(found[f].counters), known ? 0 : stored(all[f].counters)) << f;
        EXPECT_EQ(found[f].counters.store.tiles_not_written, known ? (kind.arrays + 1) * kTiles : 0) << f;
        const Traffic signatures = found[f].counters.ledger.traffic(Unit::kResolve, Purpose::kSignatures);
        EXPECT_EQ(signatures.read_bytes, known ? (kind.arrays + 1) * kTiles * 8 : 0) << f;
        EXPECT_EQ(signatures.written_bytes, (kind.arrays + 1) * kTiles * 8) << f;
        EXPECT_EQ(found[f].counters.store.signature_bytes, (kind.pixel_bytes + 4) * kPixels) << f;
      }
    }
}

// The colour of tile 9 changes. Its G-buffer is stored again, and its depths are not.
TEST(StoredArrays, AChangedTileIsStoredAgain) {  // SA3
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    const auto all = frames_of(squares(false, true), kind.graph, kind.keys, {{0, 1, 2}}),
               found = frames_of(squares(false, true), kind.graph, plus(kind.keys, {kTransactions}), {{0, 1, 2}});
    const std::map<std::string, std::uint64_t> gbuffers = {{"exact", 64}, {"packed", 16}, {"wide", 24}};
    const std::uint64_t bytes = gbuffers.contains(kind.name) ? gbuffers.at(kind.name) * kSamples * kTilePixels : 0;
    for (std::size_t f = 1; f < found.size(); ++f) {
      EXPECT_TRUE(same_image(found[f], all[f])) << f;
      EXPECT_EQ(stored(found[f].counters), bytes) << f;
    }
  }
}

// Signatures of four bits match wrongly. A counter tells; the emulator goes on with the new texels.
TEST(StoredArrays, AWrongMatchIsCounted) {
  const Kind exact = kinds()[1];
  const Asked run{{0, 1, 2, 3, 4, 5, 6, 7}};
  const auto wrong = [&](const std::string& bits) {
    const auto found = frames_of(squares(true, true), exact.graph,
                                 plus(exact.keys, {kTransactions, "frame_buffer.signature_bits=" + bits}), run);
    std::uint64_t sum = 0;
    // The frame's own wrong matches show in the image; the G-buffer's come first, in the pass that fills it.
    for (const FrameResult& frame : found) sum += frame.passes.front().counters.store.wrong_matches;
    return sum;
  };
  EXPECT_GT(wrong("4"), 0u);
  EXPECT_EQ(wrong("64"), 0u);
}

// Tiles with the inputs of the frame before do nothing in any pass: the frame has the image and, but for one tile, no traffic.
TEST(StoredArrays, ATileThatIsNotRenderedMovesNothing) {
  for (const Kind& kind : kinds())
    for (const bool change : {false, true}) {
      SCOPED_TRACE(kind.name + (change ? " changes" : " rests"));
      const Asked run{{0, 1, 2}};
      const auto all = frames_of(squares(false, change), kind.graph, kind.keys, run),
                 found = frames_of(squares(false, change), kind.graph, plus(kind.keys, {kRendering}), run),
                 packed = frames_of(squares(false, change), kind.graph,
                                    plus(kind.keys, {kRendering, kTransactions, kCompressed}), run);
      for (std::size_t f = 0; f < found.size(); ++f) {
        EXPECT_TRUE(same_image(found[f], all[f])) << f;
        EXPECT_TRUE(same_image(packed[f], all[f])) << f;
        const std::uint64_t pixels = f == 0 ? kPixels : change ? kTilePixels : 0;
        EXPECT_EQ(stored(found[f].counters), kind.pixel_bytes * pixels) << f;
        EXPECT_EQ(loaded(found[f].counters), kind.loads ? kind.pixel_bytes * pixels : 0) << f;
        EXPECT_EQ(found[f].counters.elimination.tiles_eliminated, kTiles - pixels / kTilePixels) << f;
        if (pixels == 0) {
          EXPECT_EQ(stored(packed[f].counters) + loaded(packed[f].counters), 0u) << f;
        }
      }
    }
}

// ---- Images ----------------------------------------------------------------------------------------------------------

// Without light every level is as a clear leaves it. A step writes the headers of its level, which the next steps and the last
// pass read: levels of 48x32, 24x16 and 12x8 texels in blocks of 8x8 or 8x4.
TEST(StoredArrays, ADarkBloomMovesHeadersAlone) {
  scene::Capture dark = nothing();
  dark.settings.background = Vec3(0);
  for (const auto& [format, rows] : {std::pair{AttachmentFormat::kR11G11B10F, 8}, {AttachmentFormat::kRgba16F, 4}}) {
    const auto frames = frames_of(dark, blooming(format, 3), {kCompressed});
    const auto blocks = [rows = rows](int w, int h) {
      return bursts(static_cast<std::uint64_t>((w + 7) / 8 * ((h + rows - 1) / rows)));
    };
    const std::array<std::uint64_t, 3> level{blocks(48, 32), blocks(24, 16), blocks(12, 8)};
    const std::vector<PassResult>& passes = frames[0].passes;
    ASSERT_EQ(passes.size(), 7u);
    const std::array<std::size_t, 5> written{0, 1, 2, 1, 0};
    const std::array<std::vector<std::size_t>, 5> read{{{}, {0}, {1}, {2, 1}, {1, 0}}};
    for (std::size_t step = 0; step < written.size(); ++step) {
      const FrameCounters& counters = passes[step + 1].counters;
      EXPECT_EQ(stored(counters), level[written[step]]) << step;
      if (step == 0) continue;  // it also reads the colours
      std::uint64_t bytes = 0;
      for (const std::size_t l : read[step]) bytes += level[l];
      EXPECT_EQ(loaded(counters), bytes) << step;
    }
  }
}

TEST(StoredArrays, ACompressedBloomKeepsTheImage) {  // SA2
  scene::Capture bright = squares(true, false);
  bright.settings.environment = 3;
  for (const AttachmentFormat format : {AttachmentFormat::kR11G11B10F, AttachmentFormat::kRgba16F})
    for (const auto& [width, height] : {std::pair{96, 64}, {100, 70}, {37, 19}}) {
      const Asked run{{0}, width, height, true};
      const FrameResult raw = std::move(frames_of(bright, blooming(format, 4), {kRaw}, run).front()),
                        packed = std::move(frames_of(bright, blooming(format, 4), {kCompressed}, run).front());
      EXPECT_TRUE(same_image(raw, packed));
      // A pass loads the bytes that the last one stored there.
      const std::vector<PassResult>& passes = packed.passes;
      for (std::size_t down = 2; down <= 4; ++down)
        EXPECT_EQ(loaded(passes[down].counters), stored(passes[down - 1].counters)) << down;
      EXPECT_EQ(loaded(passes[5].counters), stored(passes[4].counters) + stored(passes[3].counters));
      EXPECT_EQ(loaded(passes[6].counters), stored(passes[5].counters) + stored(passes[2].counters));
      EXPECT_EQ(loaded(passes[7].counters), stored(passes[6].counters) + stored(passes[1].counters));
      EXPECT_EQ(loaded(passes[8].counters), stored(passes[7].counters) + stored(passes[0].counters));
    }
}

// A history is read one frame after it was stored, from the other of two places.
TEST(StoredArrays, AHistoryIsReadAsItWasStored) {  // SA2
  for (const bool depths : {false, true}) {
    const Asked run{{0, 1, 2, 3}};
    const PassGraph graph = test::antialiasing(depths);
    const auto raw = frames_of(squares(true, true), graph, {kRaw}, run),
               packed = frames_of(squares(true, true), graph, {kCompressed}, run);
    for (std::size_t f = 0; f < raw.size(); ++f) {
      EXPECT_TRUE(same_image(raw[f], packed[f])) << f;
      const std::vector<PassResult>& passes = packed[f].passes;
      ASSERT_EQ(passes.size(), 3u);
      EXPECT_LT(stored(packed[f].counters), stored(raw[f].counters));
      // All that the first pass stores, and the history of the frame before.
      if (f == 0) continue;
      EXPECT_EQ(loaded(passes[1].counters), stored(passes[0].counters) + stored(packed[f - 1].passes[1].counters)) << f;
      EXPECT_EQ(loaded(passes[2].counters), stored(passes[1].counters)) << f;
    }
  }
}

// Signatures leave images of later passes as they are.
TEST(StoredArrays, SignaturesKeepBloomsAndHistories) {  // SA3
  for (const PassGraph& graph : {blooming(AttachmentFormat::kR11G11B10F, 4), test::antialiasing(true)}) {
    const Asked run{{0, 1, 2, 5, 6}, 100, 70};
    const auto all = frames_of(squares(false, true), graph, {kCompressed}, run),
               found = frames_of(squares(false, true), graph, {kCompressed, kTransactions}, run);
    for (std::size_t f = 0; f < all.size(); ++f) {
      EXPECT_TRUE(same_image(found[f], all[f])) << f;
      EXPECT_EQ(found[f].counters.store.wrong_matches, 0u) << f;
      EXPECT_LE(stored(found[f].counters), stored(all[f].counters)) << f;
      EXPECT_EQ(loaded(found[f].counters), loaded(all[f].counters)) << f;
    }
    EXPECT_LT(stored(found[1].counters), stored(all[1].counters));
  }
}

// Velocities of a scene that rests are zero, and samples move, so they are stored once and colours again.
TEST(StoredArrays, StillVelocitiesAreStoredOnce) {  // SA3
  const auto frames = frames_of(nothing(), test::antialiasing(false), {kTransactions}, {{0, 1, 2, 3}});
  for (std::size_t f = 2; f < frames.size(); ++f) {  // without a previous frame velocities are infinite
    EXPECT_EQ(stored(frames[f].passes[0].counters), 0u) << f;
    EXPECT_EQ(frames[f].passes[0].counters.store.tiles_not_written, 2 * kTiles) << f;
  }
  EXPECT_EQ(stored(frames[1].passes[0].counters), 4 * kPixels);
}

TEST(StoredArrays, ResultsDoNotDependOnThreads) {
  for (const Kind& kind : kinds()) {
    const auto render = [&] {
      return frames_of(squares(false, true), kind.graph, plus(kind.keys, {kCompressed, kTransactions}), {{0, 1}});
    };
    std::vector<FrameResult> one, four;
    with_threads(1, [&] { one = render(); });
    with_threads(4, [&] { four = render(); });
    for (std::size_t f = 0; f < one.size(); ++f) {
      EXPECT_TRUE(same_image(one[f], four[f]));
      EXPECT_EQ(stored(one[f].counters), stored(four[f].counters));
      EXPECT_EQ(one[f].model->timing.cycles, four[f].model->timing.cycles);
      EXPECT_EQ(one[f].model->energy.total_nj(), four[f].model->energy.total_nj());
    }
  }
}

}  // namespace
}  // namespace tessera::gpu::stored_arrays_test
