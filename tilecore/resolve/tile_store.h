#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "base/image.h"
#include "base/rect.h"
#include "base/vec.h"
#include "memory/ledger.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/resolve/touched_bursts.h"
#include "tilecore/resolve/unchanged_blocks.h"

namespace tessera::tilecore {

struct StoreCounters {
  std::uint64_t tiles_not_written = 0;
  std::uint64_t wrong_matches = 0;
  std::uint64_t signature_bytes = 0;
  std::uint64_t pixels_coded = 0, pixels_compressed = 0, pixels_decompressed = 0;
};

// The colours in the frame buffer of a view, and the signatures of the colours written last. Tiles use disjoint parts
// of it.
struct StoredFrame {
  std::vector<std::optional<std::uint64_t>> signatures;  // by tile; nullopt: its colours are unknown
  Image color;                                           // FrameTargets::color before the store
  bool known = false;                                    // holds an earlier frame

  // Marks the content as unknown.
  void forget(std::size_t tiles, IntRect region);
};

// Storage format of the pixels of a frame or of an attachment of colours; keys frame_buffer.*.
struct FrameStore {
  PixelCoder coder;
  bool compressed = false;
  int samples = 1;  // stored of each pixel
  memory::Purpose purpose = memory::Purpose::kFrameBuffer;
  std::uint64_t base = 0;  // base address within the purpose's memory
  // Uncompressed pixels lie tile by tile, and tiles may share bursts: the recorder charges them, and TileStore moves none.
  bool by_tile = false;
  int signature_bits = 64;
  StoredFrame* before = nullptr;  // transaction elimination; nullptr: every tile is written
  // If the frame is compressed and passes load it: the stored bytes of each block, row by row and in it sample by sample,
  // which store() keeps up to date. nullptr: no pass loads it.
  std::vector<std::uint16_t>* payloads = nullptr;

  std::uint64_t signature_bytes() const { return static_cast<std::uint64_t>(signature_bits + 7) / 8; }
};
// The lowest `bits` bits of a signature, which are kept.
constexpr std::uint64_t kept_bits(std::uint64_t signature, int bits) {
  return bits >= 64 ? signature : signature & ((std::uint64_t{1} << bits) - 1);
}

// The last unit of a tile core: stores a tile's finished colours into the frame buffer.
//
//   colours -> code of the format -> signature: as in the frame before? no write
//                                 -> blocks, compressed each on its own -> bursts, and a header for each block
//
// Without compression a tile's pixels lie row by row in the frame, whose rows begin at bursts. With it, each block
// (stored_block()) has a place of as many bytes as its pixels take; the headers lie in an array behind them, tile by
// tile, and the recorder charges them, as tiles share bursts of that array. Blocks that the region cuts are filled up
// with copies of their nearest pixels and take no more than their existing rows.
//
// Attachments of passes are stored the same way, but for raw pixels, which lie tile by tile. If one keeps all samples, a block
// of pixels is a block for each sample. Samples behind the first hold the difference from it, as in TexelFormat.
//
// Invariants (cited by the tests):
//   PS1  The traffic of a tile does not depend on other tiles.
//   PS2  A compressed tile takes no more bursts than its blocks do raw.
//   PS3  A tile is left unwritten only if its signature matches the stored content; if its pixels differ nevertheless,
//        the image shows the stored content, and the mismatch is counted.
//   PS4  Kept pixels are not written: with compression, blocks of which all pixels are kept; without, bursts in
//        which only such pixels lie. Bursts with others are written under a mask.
class TileStore {
 public:
  struct Tile {
    std::size_t number = 0;
    IntRect pixels, region;
    std::uint64_t burst_bytes = 64;
    // A second pass will change pixels of it: it is stored raw, and has no signature.
    bool open = false;
    const UnchangedBlocks* unchanged = nullptr;  // nullptr: no block is unchanged
    // Unless nullptr, store() leaves there the bytes of each block of a compressed frame, row by row.
    std::vector<std::uint16_t>* payloads = nullptr;
  };

  struct Outcome {
    bool written;  // not eliminated
    bool changed;  // the image's pixels differ from the given ones
  };
  // `color`: of the region. It keeps its value from before the store, except for tiles whose signature matches wrongly.
  Outcome store(const FrameStore& how, const Tile& tile, Image& color, memory::Ledger& ledger);

  // Stores into an attachment: also rounds the colours to its codes, as a later pass loads them. If it keeps all samples,
  // `color` has their means, and the tile's samples were rounded just before.
  Outcome store_attachment(const FrameStore& how, const Tile& tile, Image& color, memory::Ledger& ledger);

  // Rounds a tile's colours to the codes of an attachment of that format; the caller charges the moved bytes.
  void round(const PixelCoder& coder, const Tile& tile, Image& color);
  // Likewise the samples of a tile, for an attachment that keeps every one: colours and coverages. `signs`: keeps their
  // codes for the signature of the tile.
  void round(const PixelCoder& coder, std::span<Vec3> color, std::span<float> coverage, bool signs);
  // Charges a tile that reads its pixels as they are stored, without headers, and their decompression.
  void load(const FrameStore& how, const Tile& tile, memory::Ledger& ledger);

  StoreCounters take_counters() { return std::exchange(counters_, {}); }

  // Bytes of the pixels of a frame in memory with their headers, for the map of addresses.
  static std::uint64_t frame_bytes(const FrameStore& how, IntRect region);
  // Offset of the headers there, and the bytes of a tile's headers.
  static std::uint64_t header_offset(const FrameStore& how, IntRect region);
  static std::uint64_t header_bytes(const FrameStore& how, IntRect tile);

 private:
  void find_codes(const FrameStore& how, const Tile& tile, const Image& color);
  // Whether the stored content has the tile's signature.
  bool matches(const FrameStore& how, const Tile& tile);
  // Copies the stored content into the image; returns true if the image was different.
  bool keep_what_is_there(const FrameStore& how, const Tile& tile, Image& color);
  // Each fills transfers_ with a tile's transfers.
  void plan_compressed(const FrameStore& how, const Tile& tile);
  void plan_rows(const FrameStore& how, const Tile& tile);
  void plan_payloads(const FrameStore& how, const Tile& tile);
  void plan_changed_rows(const FrameStore& how, const Tile& tile);
  std::uint64_t compressed_bytes(const FrameStore& how, const Tile& tile, int column, int row,
                                 std::size_t sample) const;
  static void round_pixels(const PixelCoder& coder, const Tile& tile, Image& color);

  struct Transfer {
    std::uint64_t offset, bytes;
  };
  std::vector<PixelCode> codes_;  // of the current tile, row by row
  std::vector<Transfer> transfers_;
  TouchedBursts touched_;
  StoreCounters counters_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::StoreCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::StoreCounters> = std::to_array<CounterField<tilecore::StoreCounters>>({
    {"resolve.tiles_not_written", &tilecore::StoreCounters::tiles_not_written, Combine::kSum, "tiles",
     "Tiles whose colours, depths or other texels have the signature of the content of the frame buffer or of the "
     "attachment into which their pass stores them, once for each of these, with frame_buffer.transaction_elimination.",
     "MaliFragTileKill (FRAG_TRANS_ELIM)"},
    {"resolve.wrong_matches", &tilecore::StoreCounters::wrong_matches, Combine::kSum, "tiles",
     "Tiles of these whose pixels differ nevertheless. Where they are colours, the image is wrong there; the emulator "
     "stores other texels all the same.",
     ""},
    {"resolve.signature_bytes", &tilecore::StoreCounters::signature_bytes, Combine::kSum, "bytes",
     "Bytes of stored colours and other texels hashed for signatures of tiles.", ""},
    {"resolve.pixels_coded", &tilecore::StoreCounters::pixels_coded, Combine::kSum, "pixels",
     "Finished pixels that were tone-mapped and coded for a frame buffer, or an attachment, of rgba8 or rgb10a2.", ""},
    {"resolve.pixels_compressed", &tilecore::StoreCounters::pixels_compressed, Combine::kSum, "pixels",
     "Pixels of blocks of the frame buffer, or of what passes store, that were compressed and written. A sample counts "
     "as a pixel, and so does each word of 32 bits of a G-buffer.",
     ""},
    {"resolve.pixels_decompressed", &tilecore::StoreCounters::pixels_decompressed, Combine::kSum, "pixels",
     "Pixels of blocks that passes loaded and decompressed, counted in the same way.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::StoreCounters);

}  // namespace tessera
