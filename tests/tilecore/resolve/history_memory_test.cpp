// Bytes of the previous frame that tiles ask for, by closed forms; signatures of blocks.
#include "tilecore/resolve/history_memory.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/resolve/unchanged_blocks.h"

namespace tessera::tilecore::history_memory_test {
namespace {

std::uint64_t bytes_of(TouchedBursts& touched, std::uint64_t burst) {
  std::uint64_t bursts = 0;
  for (const TouchedBursts::Run& run : touched.runs()) bursts += run.end - run.first;
  return bursts * burst;
}

// The history of a frame of 64x32 pixels, two tiles.
struct Frame {
  HistoryStorage how{.coder = PixelCoder(FrameFormat::kRgba16f)};
  ResolveSettings settings;
  History history{IntRect{0, 0, 64, 32}};

  std::uint64_t colors(IntRect pixels) const {
    TouchedBursts touched;
    touched.start(how.burst_bytes);
    HistoryMemory(how, settings, history.region).touch_colors(history, pixels, touched);
    return bytes_of(touched, how.burst_bytes);
  }
  std::uint64_t records(IntRect pixels) const {
    TouchedBursts touched;
    touched.start(how.burst_bytes);
    HistoryMemory(how, settings, history.region).touch_records(history, pixels, touched);
    return bytes_of(touched, how.burst_bytes);
  }
};

TEST(HistoryMemory, ARawFrameBufferIsReadByBurstsOfItsRows) {
  Frame frame;
  // Eight pixels of half floats are a burst; five columns that begin at 7 lie in two.
  EXPECT_EQ(frame.colors({0, 0, 4, 4}), 4u * 64);
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 5u * 2 * 64);
  EXPECT_EQ(frame.colors({0, 0, 64, 32}), 64u * 32 * 8);
  frame.how.coder = PixelCoder(FrameFormat::kRgba8);
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 5u * 64);
  EXPECT_EQ(frame.colors({0, 0, 64, 32}), 64u * 32 * 4);
  frame.settings.colors = HistoryColors::kApart;
  EXPECT_EQ(frame.colors({0, 0, 64, 32}), 64u * 32 * 16);
}

TEST(HistoryMemory, ACompressedOneByTheBlocksThatWereStored) {  // HM1
  Frame frame;
  frame.how.compressed = true;
  frame.history.payload.assign(64 / 8 * 32 / 4, 64);
  // Two columns and two rows of blocks of 8x4, a burst each, and the burst that their headers lie in.
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 4u * 64 + 64);
  frame.history.payload[0] = 192;
  frame.history.payload[1] = 0;  // as after a clear
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 192u + 2 * 64 + 64);
  // Stored raw: the three rows that are asked for, and the two.
  for (std::uint16_t& payload : frame.history.payload) payload = 256;
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 2u * (3 + 2) * 64 + 64);
  // The failing twin: blocks of unknown size count as raw blocks.
  frame.history.payload.clear();
  EXPECT_EQ(frame.colors({7, 1, 12, 6}), 2u * (3 + 2) * 64 + 64);
}

// The decoder counts the requested pixels, the decompressor all pixels of the blocks that hold them: two columns and one
// row of 8x8 in rgba8, two rows of 8x4 in half floats, which need no decoder.
TEST(HistoryMemory, PixelsThatAreDecodedAndDecompressed) {
  const IntRect asked{7, 1, 12, 6};
  for (const auto& [format, decoded, decompressed] :
       {std::tuple{FrameFormat::kRgba8, 25u, 2u * 64}, {FrameFormat::kRgba16f, 0u, 4u * 32}}) {
    Frame frame;
    frame.how.coder = PixelCoder(format);
    frame.how.compressed = true;
    const auto counted = [&] {
      const HistoryMemory memory(frame.how, frame.settings, frame.history.region);
      return std::pair(memory.decoded_pixels(asked), memory.decompressed_pixels(asked));
    };
    EXPECT_EQ(counted(), std::pair(std::uint64_t{decoded}, std::uint64_t{decompressed}));
    frame.how.compressed = false;
    EXPECT_EQ(counted().second, 0u);
    frame.settings.colors = HistoryColors::kApart;  // single precision is neither
    EXPECT_EQ(counted(), std::pair(std::uint64_t{0}, std::uint64_t{0}));
  }
}

// A frame that is read whole reads back the bytes that the store wrote.
TEST(HistoryMemory, AWholeCompressedFrameReadsTheBytesThatItWrote) {
  for (const FrameFormat format : {FrameFormat::kRgba8, FrameFormat::kRgb10a2, FrameFormat::kRgba16f}) {
    test::Random random(5);
    Frame frame;
    frame.how.coder = PixelCoder(format);
    frame.how.compressed = true;
    FrameStore store;
    store.coder = frame.how.coder;
    store.compressed = true;
    const IntRect region = frame.history.region;
    frame.history.payload.resize(TileStore::header_bytes(store, region));
    Image image(64, 32, 4);
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 64; ++x)
        for (std::size_t c = 0; c < 4; ++c)
          image.at(x, y)[c] = x < 32 ? 0.25f + 0.001f * static_cast<float>(x + y) : random.uniform(0, 1);
    memory::Ledger ledger;
    TileStore unit;
    for (std::size_t t = 0; t < 2; ++t) {
      TileStore::Tile tile{t, {static_cast<int>(t) * 32, 0, static_cast<int>(t) * 32 + 32, 32}, region, 64};
      tile.payloads = &frame.history.payload;
      unit.store(store, tile, image, ledger);
    }
    EXPECT_EQ(frame.colors(region), ledger.total().written_bytes + 64) << "and a burst of headers";
  }
}

TEST(HistoryMemory, RecordsAreReadByCells) {
  Frame frame;
  frame.history.cells = {128, 64, 192, 320, 64, 64, 64, 64};
  EXPECT_EQ(frame.records({7, 1, 12, 6}), 128u);
  EXPECT_EQ(frame.records({15, 15, 17, 17}), 128u + 64 + 64 + 64);
}

TEST(HistoryMemory, NothingIsReadWhereNothingIsSeen) {  // HM2
  Frame frame;
  EXPECT_GT(frame.records({0, 0, 64, 32}), 0u);  // the failing twin
  for (std::uint8_t& state : frame.history.memory) state = 16 | History::kNothingSeen;
  EXPECT_EQ(frame.records({0, 0, 64, 32}), 0u);
}

TEST(HistoryMemory, StatesLieTileByTile) {
  Frame frame;
  const HistoryMemory places(frame.how, frame.settings, frame.history.region);
  const auto bytes = [&](IntRect blocks) {
    TouchedBursts touched;
    touched.start(64);
    places.touch_states(blocks, touched);
    return bytes_of(touched, 64);
  };
  EXPECT_EQ(bytes({0, 0, 8, 8}), 64u);
  EXPECT_EQ(bytes({0, 0, 9, 8}), 128u);  // a column of the next tile
}

// ---- Signatures of blocks ---------------------------------------------------------------------------------------

SignedBlock any_signed_block(test::Random& random) {
  SignedBlock block;
  for (std::size_t p = 0; p < 16; ++p) {
    for (std::uint16_t& code : block.codes[p]) code = static_cast<std::uint16_t>(random.integer(0, 0xffff));
    block.depth[p] = random.uniform(1, 9);
    block.surface[p] = static_cast<std::uint32_t>(random.integer(0, 5));
  }
  return block;
}

TEST(BlockSignature, MatchesWhereShadedColorsDepthsAndSurfacesAreEqual) {  // KB1
  test::Random random(3);
  for (int n = 0; n < 500; ++n) {
    const SignedBlock block = any_signed_block(random);
    const BlockSignature expected = signature_of(block, 64);
    for (const BlockMask shaded : kPairOrder) {
      EXPECT_TRUE(matches(signature_of(block, 64), expected, kFullBlock, shaded));
      const auto p = static_cast<std::size_t>(random.integer(0, 15));
      SignedBlock color = block, depth = block, surface = block;
      color.codes[p][static_cast<std::size_t>(random.integer(0, 3))] ^= static_cast<std::uint16_t>(1 << n % 16);
      depth.depth[p] = -depth.depth[p];
      ++surface.surface[p];
      // The colours of pixels that are not shaded are not compared.
      EXPECT_EQ(matches(signature_of(color, 64), expected, kFullBlock, shaded), (shaded >> p & 1) == 0);
      EXPECT_FALSE(matches(signature_of(depth, 64), expected, kFullBlock, shaded));
      EXPECT_FALSE(matches(signature_of(surface, 64), expected, kFullBlock, shaded));
    }
  }
}

TEST(BlockSignature, MatchesDifferentBlocksWhereItHasFewBits) {
  test::Random random(4);
  int wrong = 0;
  for (int n = 0; n < 4000; ++n) {
    const SignedBlock block = any_signed_block(random);
    SignedBlock other = block;
    for (PixelCode& code : other.codes) ++code[0];
    wrong += matches(signature_of(block, 4), signature_of(other, 4), kFullBlock, kPairOrder[0]);
    EXPECT_FALSE(matches(signature_of(block, 64), signature_of(other, 64), kFullBlock, kPairOrder[0]));
  }
  // Two squares of 4 bits each: one in 256.
  EXPECT_NEAR(wrong, 4000 / 256.0, 4 * 4);
}

}  // namespace
}  // namespace tessera::tilecore::history_memory_test
