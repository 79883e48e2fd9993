// Attachments of colours in memory (gpu/attachment_stores.h, tilecore/resolve/tile_store.h): their compression by closed
// forms, tiles that are not stored again, tiles that are not rendered again, and images that do not change.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tile_squares.h"

namespace tessera::gpu::attachment_storage_test {
namespace {

using memory::Purpose;
using memory::Traffic;
using memory::Unit;
using scene::Attachment;
using scene::AttachmentFormat;
using scene::Capture;
using scene::DrawFilter;
using scene::LoadAction;
using scene::Pass;
using scene::PassGraph;
using scene::PassShader;
using scene::StoreAction;
using test::attachment;
using test::bursts;
using test::copying;
using test::drawing;
using test::over_image;
using test::tiled::Asked;
using test::tiled::bursts_moved;
using test::tiled::frames_of;
using test::tiled::kCompressed;
using test::tiled::kHeight;
using test::tiled::kPixels;
using test::tiled::kRaw;
using test::tiled::kRendering;
using test::tiled::kTilePixels;
using test::tiled::kTiles;
using test::tiled::kTransactions;
using test::tiled::kWidth;
using test::tiled::loaded;
using test::tiled::nothing;
using test::tiled::same_image;
using test::tiled::squares;
using test::tiled::stored;
using Keys = std::vector<std::string>;

// The surfaces go to `lit`, from there to `second` if there are two, and into the frame. `samples`: `lit` keeps all samples.
PassGraph by_way_of(AttachmentFormat format, int attachments = 1, bool samples = false) {
  Pass draw = drawing("lit");
  if (samples) draw.store = {{"lit", StoreAction::kStore}};
  PassGraph graph{{attachment("lit", format)}, {draw}};
  if (attachments > 1) {
    graph.attachments.push_back(attachment("second", format));
    graph.passes.push_back(copying("again", "lit", "second"));
  }
  graph.passes.push_back(copying("final", attachments > 1 ? "second" : "lit", "frame"));
  return graph;
}
// A G-buffer in memory, whose light pass stores into `lit`.
PassGraph lit_apart(AttachmentFormat format) {
  PassGraph graph = by_way_of(format);
  for (const char* name : {"a", "b"}) graph.attachments.push_back(attachment(name, AttachmentFormat::kRgba16F));
  graph.passes[0].subpasses = {{DrawFilter::kAll, PassShader::kGbuffer, {}, {"a", "b"}, {}}};
  graph.passes.insert(graph.passes.begin() + 1, over_image("light", PassShader::kLight, {"a", "b", "depth"}, "lit"));
  return graph;
}

std::uint64_t bytes_of(AttachmentFormat format) { return static_cast<std::uint64_t>(sample_bits(format) / 8); }

// ---- Compression -----------------------------------------------------------------------------------------------------

// A block of one colour takes 120 bits (4 channels of 8 or 10 bits, 4 groups) or 112 (16 bits, 2 groups): a burst. Black
// without coverage takes none. Every block has a header of a byte.
TEST(AttachmentStorage, AnAttachmentOfOneColorTakesABurstABlock) {
  for (const auto& [width, height] : {std::pair{kWidth, kHeight}, {100, 70}})
    for (const AttachmentFormat format : test::tiled::kColorFormats) {
      const int rows = format == AttachmentFormat::kRgba16F ? 4 : 8;
      const auto blocks = static_cast<std::uint64_t>((width + 7) / 8 * ((height + rows - 1) / rows));
      const Asked run{{0}, width, height};
      const FrameResult found = std::move(frames_of(nothing(), by_way_of(format), {kCompressed}, run).front());
      EXPECT_EQ(stored(found.counters), 64 * blocks + bursts(blocks));
      EXPECT_EQ(loaded(found.counters), stored(found.counters));
      Capture black = nothing();
      black.settings.background = Vec3(0);
      const FrameResult cleared = std::move(frames_of(black, by_way_of(format), {kCompressed}, run).front());
      const bool covered = cleared.targets.color.values[3] != 0;
      EXPECT_EQ(stored(cleared.counters), (covered ? 64 * blocks : 0) + bursts(blocks));
      // Raw, and with more than one colour, the same attachment takes more.
      const FrameResult raw = std::move(frames_of(nothing(), by_way_of(format), {kRaw}, run).front()),
                        mixed =
                            std::move(frames_of(squares(true, false), by_way_of(format), {kCompressed}, run).front());
      EXPECT_EQ(stored(raw.counters), bursts(bytes_of(format) * static_cast<std::uint64_t>(width * height)));
      EXPECT_GT(stored(raw.counters), stored(found.counters));
      EXPECT_GT(stored(mixed.counters), stored(found.counters));
    }
}

TEST(AttachmentStorage, ALoadReadsTheStoredBytes) {  // AST1, AST2
  for (const AttachmentFormat format : test::tiled::kColorFormats)
    for (const PassGraph& graph : {by_way_of(format), by_way_of(format, 2), lit_apart(format)}) {
      const Capture capture = squares(true, false);
      const FrameResult raw = std::move(frames_of(capture, graph, {kRaw}).front()),
                        packed = std::move(frames_of(capture, graph, {kCompressed}).front());
      EXPECT_TRUE(same_image(raw, packed));
      EXPECT_EQ(stored(packed.counters), loaded(packed.counters));
      EXPECT_LT(stored(packed.counters), stored(raw.counters));
      EXPECT_EQ(packed.counters.store.pixels_compressed % kPixels, 0u);
      EXPECT_EQ(packed.passes.back().counters.store.pixels_decompressed, kPixels);
      EXPECT_EQ(raw.counters.store.pixels_decompressed, 0u);
    }
}

// Tiles request as many bytes as the ledger counts, so clocks and the memory see them.
TEST(AttachmentStorage, TilesMoveTheBytesOfTheLedger) {
  for (const char* timing : {"machine.timing=events", "machine.timing=phases"})
    for (const AttachmentFormat format : test::tiled::kColorFormats) {
      const Capture capture = squares(true, false);
      const PassGraph graph = by_way_of(format, 2);
      const FrameResult raw = std::move(frames_of(capture, graph, {kRaw, timing}).front()),
                        packed = std::move(frames_of(capture, graph, {kCompressed, timing}).front());
      const timing::FrameWork& work = packed.model->record.work;
      ASSERT_GE(work.rounds.size(), 3u);
      for (std::size_t back = 1; back <= 2; ++back) {
        const timing::WorkRound& round = work.rounds[work.rounds.size() - back];
        const Traffic total = packed.passes[packed.passes.size() - back].counters.ledger.total();
        std::uint64_t moved = 0;
        for (const timing::TileWork& tile : round.tiles)
          moved = std::accumulate(tile.dram_bytes.begin(), tile.dram_bytes.end(), moved);
        EXPECT_EQ(moved, total.read_bytes + total.written_bytes);
      }
      EXPECT_LT(packed.model->energy.total_nj(), raw.model->energy.total_nj()) << timing;
      EXPECT_NE(packed.model->timing.cycles, raw.model->timing.cycles) << timing;
    }
}

// No two attachments, blocks or headers share a burst, and a pass reads only bursts that were written.
TEST(AttachmentStorage, EveryBurstIsWrittenOnceAndReadOnce) {  // AST2
  for (const std::string& key : {kRaw, kCompressed})
    for (const auto& [width, height] : {std::pair{kWidth, kHeight}, {100, 70}}) {
      const Asked run{{0}, width, height, true};
      const FrameResult found =
          std::move(frames_of(squares(true, false), by_way_of(AttachmentFormat::kRgba16F, 2), {key}, run).front());
      const auto [written, read] = bursts_moved(found);
      EXPECT_FALSE(written.empty());
      EXPECT_EQ(written, read) << key;
      for (const auto& [burst, times] : written) EXPECT_EQ(times, 1) << key << " " << burst;
    }
}

// A pass that loads its attachment before it draws finds the bytes that the frame before left: at first nothing but headers.
TEST(AttachmentStorage, ALoadBeforeDrawingReadsThePreviousFrame) {  // AST2
  for (PassGraph graph : {by_way_of(AttachmentFormat::kRgba16F), lit_apart(AttachmentFormat::kRgba16F)}) {
    graph.passes[graph.passes.size() - 2].load = {{"lit", LoadAction::kLoad}};
    const Capture capture = squares(true, true);
    const auto frames = frames_of(capture, graph, {kCompressed}, {{0, 1, 2}});
    const std::uint64_t headers = bursts(kPixels / 32);
    EXPECT_EQ(loaded(frames[0].counters), headers + stored(frames[0].counters));
    // A G-buffer in memory moves once each way beside it.
    for (std::size_t f = 1; f < frames.size(); ++f) {
      const std::uint64_t gbuffer = graph.passes.size() == 3 ? stored(frames[f - 1].passes[0].counters) : 0;
      EXPECT_EQ(loaded(frames[f].counters) + gbuffer, stored(frames[f - 1].counters) + stored(frames[f].counters));
    }
    EXPECT_NE(stored(frames[0].counters), stored(frames[2].counters));
  }
}

// The light pass of a stored G-buffer reads the frame it loads, pixels included.
TEST(AttachmentStorage, ALightPassLoadsTheFrame) {
  PassGraph graph = lit_apart(AttachmentFormat::kRgba8);
  graph.attachments.erase(graph.attachments.begin());
  graph.passes.pop_back();
  graph.passes[1].subpasses[0].write = {"frame"};
  const auto read = [&](const PassGraph& g) {
    return frames_of(squares(true, false), g, {})
        .front()
        .counters.ledger.traffic(Unit::kTilecore, Purpose::kFrameBuffer)
        .read_bytes;
  };
  EXPECT_EQ(read(graph), 0u);
  graph.passes[1].load = {{"frame", LoadAction::kLoad}};
  EXPECT_EQ(read(graph), 4 * kPixels);
}

// ---- Transaction elimination -----------------------------------------------------------------------------------------

struct Stored {
  PassGraph graph;
  std::uint64_t pixel_bytes;  // of all attachments
  int attachments;
  Keys keys{};
};
std::vector<Stored> kinds_of_storage() {
  std::vector<Stored> all;
  for (const AttachmentFormat format : test::tiled::kColorFormats) {
    const std::uint64_t bytes = bytes_of(format);
    all.push_back({by_way_of(format), bytes, 1});
    all.push_back({by_way_of(format, 2), 2 * bytes, 2});
    all.push_back({by_way_of(format, 1, true), 4 * bytes, 1, {"sampling.samples_per_pixel=4"}});
    all.push_back({by_way_of(format, 2, true), 5 * bytes, 2, {"sampling.samples_per_pixel=4"}});
  }
  return all;
}

TEST(AttachmentStorage, AStillAttachmentIsStoredOnce) {  // AST1, AST3
  for (Stored& kind : kinds_of_storage())
    for (const std::string& key : {kRaw, kCompressed}) {
      Keys keys = kind.keys;
      keys.push_back(key);
      const auto plain = frames_of(squares(true, false), kind.graph, keys, {{0, 1, 2, 7}});
      keys.push_back(kTransactions);
      const auto found = frames_of(squares(true, false), kind.graph, keys, {{0, 1, 2, 7}});
      for (std::size_t f = 0; f < found.size(); ++f) {
        EXPECT_TRUE(same_image(found[f], plain[f]));
        EXPECT_EQ(found[f].counters.store.wrong_matches, 0u);
        EXPECT_EQ(loaded(found[f].counters), loaded(plain[f].counters)) << "copies read what is there";
        // Frame 7 does not follow frame 5, so the machine does not know the content of the memory.
        const bool known = f == 1 || f == 2;
        EXPECT_EQ(stored(found[f].counters), known ? 0 : stored(plain[f].counters)) << f;
        const auto attachments = static_cast<std::uint64_t>(kind.attachments), arrays = attachments + 1;
        EXPECT_EQ(found[f].counters.store.tiles_not_written, known ? arrays * kTiles : 0) << f;
        const Traffic signatures = found[f].counters.ledger.traffic(Unit::kResolve, Purpose::kSignatures);
        EXPECT_EQ(signatures.read_bytes, known ? arrays * kTiles * 8 : 0) << f;
        EXPECT_EQ(signatures.written_bytes, arrays * kTiles * 8) << f;
        EXPECT_EQ(found[f].counters.store.signature_bytes, (kind.pixel_bytes + 4) * kPixels)
            << "hashed, the frame's too";
      }
      EXPECT_LT(found[1].model->energy.total_nj(), plain[1].model->energy.total_nj());
    }
}

// The colour of one tile changes: the machine stores that tile again, and no other.
TEST(AttachmentStorage, AChangedTileIsStoredAgain) {  // AST1, AST3
  for (Stored& kind : kinds_of_storage()) {
    Keys keys = kind.keys;
    const auto plain = frames_of(squares(false, true), kind.graph, keys, {{0, 1, 2, 3}});
    keys.push_back(kTransactions);
    const auto found = frames_of(squares(false, true), kind.graph, keys, {{0, 1, 2, 3}});
    for (std::size_t f = 0; f < found.size(); ++f) {
      EXPECT_TRUE(same_image(found[f], plain[f])) << f;
      EXPECT_EQ(stored(found[f].counters), kind.pixel_bytes * (f == 0 ? kPixels : kTilePixels)) << f;
    }
    EXPECT_FALSE(same_image(found[0], found[1]));
    keys.push_back(kCompressed);
    const auto packed = frames_of(squares(false, true), kind.graph, keys, {{0, 1, 2, 3}});
    for (std::size_t f = 0; f < found.size(); ++f) {
      EXPECT_TRUE(same_image(packed[f], plain[f])) << f;
      EXPECT_LE(stored(packed[f].counters), stored(found[f].counters) + 2 * bursts(kPixels / 32)) << f;
      EXPECT_GT(stored(packed[f].counters), 0u) << f;
    }
  }
}

// Signatures of four bits match wrongly: the images show it, which the tests above would notice, and so does a counter.
TEST(AttachmentStorage, ASignatureThatMatchesWronglyShows) {
  for (Stored& kind : kinds_of_storage()) {
    Keys keys = kind.keys;
    const Asked run{{0, 1, 2, 3, 4, 5, 6, 7}};
    const auto plain = frames_of(squares(true, true), kind.graph, keys, run);
    keys.insert(keys.end(), {kTransactions, "frame_buffer.signature_bits=4"});
    const auto found = frames_of(squares(true, true), kind.graph, keys, run);
    std::uint64_t wrong = 0;
    bool differs = false;
    for (std::size_t f = 0; f < found.size(); ++f) {
      wrong += found[f].counters.store.wrong_matches;
      differs = differs || !same_image(found[f], plain[f]);
    }
    EXPECT_GT(wrong, 0u);
    EXPECT_TRUE(differs);
  }
}

// ---- Rendering elimination -------------------------------------------------------------------------------------------

// A tile with the inputs of the frame before draws, stores, loads and copies nothing; a changed one does all of it.
TEST(AttachmentStorage, AnUnchangedTileMovesNoAttachment) {  // AST1
  for (Stored& kind : kinds_of_storage())
    for (const bool change : {false, true}) {
      Keys keys = kind.keys;
      const auto plain = frames_of(squares(false, change), kind.graph, keys, {{0, 1, 2}});
      keys.push_back(kRendering);
      const auto found = frames_of(squares(false, change), kind.graph, keys, {{0, 1, 2}});
      for (std::size_t f = 0; f < found.size(); ++f) {
        EXPECT_TRUE(same_image(found[f], plain[f])) << f;
        const std::uint64_t pixels = f == 0 ? kPixels : change ? kTilePixels : 0;
        EXPECT_EQ(stored(found[f].counters), kind.pixel_bytes * pixels) << f;
        EXPECT_EQ(loaded(found[f].counters), kind.pixel_bytes * pixels) << f;
        EXPECT_EQ(found[f].counters.ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes, 4 * pixels);
      }
      keys.insert(keys.end(), {kTransactions, kCompressed});
      const auto all = frames_of(squares(false, change), kind.graph, keys, {{0, 1, 2}});
      for (std::size_t f = 0; f < all.size(); ++f) {
        EXPECT_TRUE(same_image(all[f], plain[f])) << f;
        if (f > 0) {
          EXPECT_EQ(stored(all[f].counters) > 0, change) << f;
        }
      }
    }
}

// A pass that loads its attachment loads the tiles that it renders.
TEST(AttachmentStorage, AnUnchangedTileIsNotLoaded) {
  PassGraph graph = by_way_of(AttachmentFormat::kRgba8);
  graph.passes[0].load = {{"lit", LoadAction::kLoad}};
  const auto found = frames_of(squares(false, true), graph, {kRendering}, {{0, 1}});
  EXPECT_EQ(loaded(found[0].counters), 2 * 4 * kPixels);
  EXPECT_EQ(loaded(found[1].counters), 2 * 4 * kTilePixels);
}

TEST(AttachmentStorage, EyesHaveAttachmentsOfTheirOwn) {
  const PassGraph graph = by_way_of(AttachmentFormat::kRgba8);
  const Keys stereo = {"stereo.eye_separation=0.3", kCompressed};
  const auto plain = frames_of(squares(true, false), graph, stereo, {{0, 1}});
  for (const std::string& key : {kTransactions, kRendering}) {
    Keys keys = stereo;
    keys.push_back(key);
    const auto found = frames_of(squares(true, false), graph, keys, {{0, 1}});
    for (std::size_t f = 0; f < 2; ++f) {
      EXPECT_TRUE(same_image(found[f], plain[f]));
      EXPECT_EQ(found[f].right->targets.color.values, plain[f].right->targets.color.values);
      EXPECT_EQ(stored(found[f].counters), f == 0 ? stored(plain[f].counters) : 0);
    }
  }
}

TEST(AttachmentStorage, ResultsDoNotDependOnThreads) {
  const Keys keys = {kCompressed, kTransactions, kRendering};
  const PassGraph graph = by_way_of(AttachmentFormat::kRgba16F, 2);
  const auto render = [&] { return frames_of(squares(false, true), graph, keys, {{0, 1, 2}}); };
  std::vector<FrameResult> one, four;
  with_threads(1, [&] { one = render(); });
  with_threads(4, [&] { four = render(); });
  for (std::size_t f = 0; f < one.size(); ++f) {
    EXPECT_TRUE(same_image(one[f], four[f]));
    EXPECT_EQ(stored(one[f].counters), stored(four[f].counters));
    EXPECT_EQ(loaded(one[f].counters), loaded(four[f].counters));
    EXPECT_EQ(one[f].model->timing.cycles, four[f].model->timing.cycles);
    EXPECT_EQ(one[f].model->energy.total_nj(), four[f].model->energy.total_nj());
  }
}

}  // namespace
}  // namespace tessera::gpu::attachment_storage_test
