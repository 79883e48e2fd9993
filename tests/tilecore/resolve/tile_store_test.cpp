// Bytes that tile cores write to the frame buffer, and bytes that need not be written.
#include "tilecore/resolve/tile_store.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::tilecore::tile_store_test {
namespace {

using memory::Purpose;
using memory::Unit;

constexpr FrameFormat kFormats[] = {FrameFormat::kRgba8, FrameFormat::kRgb10a2, FrameFormat::kRgba16f};

enum class Content { kBlack, kSmooth, kNoise };

Image image_of(IntRect region, Content content, std::uint32_t seed = 1) {
  test::Random random(seed);
  Image image(region.width(), region.height(), 4);
  for (int y = 0; y < image.height && content != Content::kBlack; ++y)
    for (int x = 0; x < image.width; ++x)
      for (std::size_t c = 0; c < 4; ++c)
        image.at(x, y)[c] =
            content == Content::kNoise ? random.uniform(0, 1) : 0.25f + 0.001f * static_cast<float>(x + y);
  return image;
}

FrameStore frame_store(FrameFormat format, bool compressed) {
  FrameStore store;
  store.coder = PixelCoder(format);
  store.compressed = compressed;
  return store;
}

// All tiles of 16x16 pixels of a region, row by row; bytes of each.
struct Stored {
  std::vector<std::uint64_t> bytes;
  StoreCounters counters;
  std::uint64_t sum() const { return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0}); }
};
Stored store_all(const FrameStore& how, IntRect region, Image& color, bool open = false) {
  TileStore unit;
  Stored out;
  std::size_t number = 0;
  for (int y = region.y0 / 16 * 16; y < region.y1; y += 16)
    for (int x = region.x0 / 16 * 16; x < region.x1; x += 16) {
      memory::Ledger ledger;
      unit.store(how, {number++, IntRect{x, y, x + 16, y + 16}.intersect(region), region, 64, open}, color, ledger);
      out.bytes.push_back(ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes);
      EXPECT_EQ(ledger.total().read_bytes, 0u);
    }
  if (how.before != nullptr) how.before->known = true;
  out.counters = unit.take_counters();
  return out;
}

TEST(TileStore, WithoutCompressionATileTakesTheBytesOfItsPixels) {
  const IntRect region{0, 0, 64, 32};
  for (const FrameFormat format : kFormats) {
    Image image = image_of(region, Content::kNoise);
    for (const std::uint64_t bytes : store_all(frame_store(format, false), region, image).bytes)
      EXPECT_EQ(bytes, 256 * frame_pixel_bytes(format));
  }
}

TEST(TileStore, ATileTakesNoMoreThanItsBlocksRaw) {  // PS1, PS2
  for (const FrameFormat format : kFormats)
    for (const IntRect region : {IntRect{0, 0, 64, 32}, IntRect{0, 0, 61, 27}, IntRect{5, 3, 50, 29}})
      for (const Content content : {Content::kBlack, Content::kSmooth, Content::kNoise}) {
        Image image = image_of(region, content);
        const Stored got = store_all(frame_store(format, true), region, image);
        const BlockShape shape = stored_block(format);
        std::size_t tile = 0;
        for (int y = region.y0 / 16 * 16; y < region.y1; y += 16)
          for (int x = region.x0 / 16 * 16; x < region.x1; x += 16) {
            const IntRect pixels = IntRect{x, y, x + 16, y + 16}.intersect(region);
            const std::uint64_t blocks = TileStore::header_bytes(frame_store(format, true), pixels);  // a byte each
            EXPECT_LE(got.bytes[tile], blocks * shape.raw_bytes());
            // Alone it takes the same.
            TileStore alone;
            memory::Ledger ledger;
            alone.store(frame_store(format, true), {tile, pixels, region, 64}, image, ledger);
            EXPECT_EQ(ledger.total().written_bytes, got.bytes[tile]);
            ++tile;
          }
        if (content == Content::kBlack) {
          EXPECT_EQ(got.sum(), 0u);
        }
        if (content == Content::kSmooth) {
          EXPECT_LT(got.sum(), store_all(frame_store(format, false), region, image).sum() * 9 / 10);
        }
      }
}

TEST(TileStore, NoiseIsStoredRawToTheByte) {
  const IntRect region{0, 0, 64, 32};
  for (const FrameFormat format : kFormats) {
    Image image = image_of(region, Content::kNoise);
    const Stored got = store_all(frame_store(format, true), region, image);
    EXPECT_EQ(got.sum(), 64 * 32 * frame_pixel_bytes(format));
  }
}

TEST(TileStore, TilesOfASecondPassAreStoredRaw) {
  const IntRect region{0, 0, 32, 32};
  Image image = image_of(region, Content::kSmooth);
  const Stored got = store_all(frame_store(FrameFormat::kRgba16f, true), region, image, true);
  EXPECT_EQ(got.sum(), 32u * 32 * 8);
}

// Closed form: of two tiles one block of 4x4 pixels in the middle changes.
TEST(TileStore, KeptBlocksAreNotWritten) {  // PS4
  const IntRect region{0, 0, 32, 16};
  for (const FrameFormat format : kFormats)
    for (const bool compressed : {false, true}) {
      Image image = image_of(region, Content::kNoise);
      TileStore unit;
      UnchangedBlocks kept;
      kept.blocks = {0, 0, 4, 4};
      kept.kept.assign(16, 1);
      kept.any = true;
      const auto written = [&] {
        memory::Ledger ledger;
        TileStore::Tile tile{0, {0, 0, 16, 16}, region, 64};
        tile.unchanged = &kept;
        const bool stored = unit.store(frame_store(format, compressed), tile, image, ledger).written;
        EXPECT_EQ(stored, ledger.total().written_bytes > 0);
        return ledger.total().written_bytes;
      };
      EXPECT_EQ(written(), 0u);
      kept.kept[5] = 0;
      // Four rows of a burst each; or the block of 256 bytes that it lies in.
      EXPECT_EQ(written(), 256u);
      // The failing twin: nothing is kept.
      kept.any = false;
      EXPECT_EQ(written(), 16 * 16 * frame_pixel_bytes(format));
    }
}

TEST(TileStore, AnImageKeepsTheLightFromBeforeTheStoreAndItsCodesAreCounted) {
  const IntRect region{0, 0, 32, 16};
  for (const FrameFormat format : kFormats)
    for (const bool compressed : {false, true}) {
      const FrameStore how = frame_store(format, compressed);
      const Image shaded = image_of(region, Content::kNoise);
      Image image = shaded;
      const Stored stored = store_all(how, region, image);
      EXPECT_EQ(image.values, shaded.values);
      EXPECT_EQ(stored.counters.pixels_coded, how.coder.tone_maps() ? 32u * 16u : 0u);
      EXPECT_EQ(stored.counters.pixels_compressed, compressed ? 32u * 16u : 0u);
    }
}

// Transaction elimination over a frame in which one pixel of one tile changes by the least that the format tells apart.
TEST(TileStore, OnlyTilesThatChangedAreWritten) {  // PS3
  const IntRect region{0, 0, 64, 48};
  for (const FrameFormat format : kFormats)
    for (const bool compressed : {false, true}) {
      StoredFrame before;
      before.forget(12, region);
      FrameStore how = frame_store(format, compressed);
      how.before = &before;
      Image first = image_of(region, Content::kNoise), same = first, other = first;
      const Stored all = store_all(how, region, first);
      EXPECT_EQ(all.counters.tiles_not_written, 0u);
      const Stored none = store_all(how, region, same);
      EXPECT_EQ(none.counters.tiles_not_written, 12u);
      EXPECT_EQ(none.counters.pixels_compressed, 0u);  // signatures come first
      EXPECT_EQ(all.counters.pixels_compressed, compressed ? 64u * 48u : 0u);
      EXPECT_EQ(none.sum(), 0u);
      other.at(20, 20)[1] = 2.0f;
      const Stored one = store_all(how, region, other);
      EXPECT_EQ(one.counters.tiles_not_written, 11u);
      EXPECT_EQ(one.sum(), one.bytes[5]);
      EXPECT_GT(one.bytes[5], 0u);
      EXPECT_EQ(one.counters.wrong_matches, 0u);
      EXPECT_EQ(before.color.values, other.values);
    }
}

TEST(TileStore, AColourThatTheFormatDoesNotTellApartIsNoChange) {
  const IntRect region{0, 0, 16, 16};
  StoredFrame before;
  before.forget(1, region);
  FrameStore how = frame_store(FrameFormat::kRgba8, false);
  how.before = &before;
  Image first = image_of(region, Content::kSmooth), next = first;
  store_all(how, region, first);
  for (float& value : next.values) value += 1e-5f;
  const Stored stored = store_all(how, region, next);
  EXPECT_EQ(stored.counters.tiles_not_written, 1u);
  EXPECT_EQ(stored.counters.wrong_matches, 0u);
}

// The twin: signatures of 4 bits match where pixels differ, which neither the counter nor the image hides.
TEST(TileStore, AWrongMatchIsCountedAndShows) {  // PS3
  const IntRect region{0, 0, 64, 48};
  const auto wrong = [&](int bits) {
    StoredFrame before;
    before.forget(12, region);
    FrameStore how = frame_store(FrameFormat::kRgba16f, false);
    how.signature_bits = bits;
    how.before = &before;
    std::uint64_t counted = 0, shown = 0;
    for (std::uint32_t frame = 0; frame < 40; ++frame) {
      Image image = image_of(region, Content::kNoise, frame);
      const Image shaded = image;
      const Stored stored = store_all(how, region, image);
      counted += stored.counters.wrong_matches;
      EXPECT_EQ(stored.counters.wrong_matches, stored.counters.tiles_not_written) << "noise is never the same";
      shown += image.values != shaded.values;
    }
    EXPECT_EQ(counted > 0, shown > 0);
    return counted;
  };
  EXPECT_GT(wrong(4), 10u);  // 39 frames of 12 tiles, one in 16
  EXPECT_EQ(wrong(64), 0u);
  EXPECT_EQ(wrong(32), 0u);
}

TEST(TileStore, ATileThatIsNotFinishedHasNoSignature) {
  const IntRect region{0, 0, 16, 16};
  StoredFrame before;
  before.forget(1, region);
  FrameStore how = frame_store(FrameFormat::kRgba16f, false);
  how.before = &before;
  Image image = image_of(region, Content::kSmooth);
  store_all(how, region, image);
  EXPECT_EQ(store_all(how, region, image, true).counters.tiles_not_written, 0u);
  EXPECT_EQ(store_all(how, region, image).counters.tiles_not_written, 0u) << "the second pass changed it";
  EXPECT_EQ(store_all(how, region, image).counters.tiles_not_written, 1u);
}

TEST(TileStore, MemoryHoldsAllThatIsAddressed) {
  for (const FrameFormat format : kFormats)
    for (const IntRect region : {IntRect{0, 0, 61, 27}, IntRect{5, 3, 50, 29}}) {
      const FrameStore how = frame_store(format, true);
      Image image = image_of(region, Content::kNoise);
      TileStore unit;
      memory::AccessLog log;
      memory::Ledger ledger;
      ledger.record_into(&log);
      unit.store(how, {0, region, region, 64}, image, ledger);
      std::uint64_t end = 0;
      for (const memory::Access& access : log.accesses()) {
        EXPECT_GE(access.offset, end) << "blocks overlap";
        end = access.offset + access.bytes;
      }
      EXPECT_LE(end, TileStore::header_offset(how, region));
      EXPECT_LT(TileStore::header_offset(how, region), TileStore::frame_bytes(how, region));
    }
}

}  // namespace
}  // namespace tessera::tilecore::tile_store_test
