#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "base/rect.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/resolve/history.h"
#include "tilecore/resolve/packed_records.h"
#include "tilecore/resolve/resolve_settings.h"
#include "tilecore/resolve/touched_bursts.h"

namespace tessera::tilecore {

// Bytes of the previous frame that tiles read, each once for a tile, and bytes that they write for the next.
struct HistoryCounters {
  std::uint64_t color_bytes = 0, record_bytes = 0, state_bytes = 0, signature_bytes = 0;
  std::uint64_t records_written = 0, states_written = 0, signatures_written = 0;
  std::uint64_t blocks_kept = 0, wrong_blocks = 0, hashed_bytes = 0;
  std::uint64_t pixels_decoded = 0, pixels_decompressed = 0;
};

// Properties of the machine that stores the history.
struct HistoryStorage {
  std::uint64_t burst_bytes = 64;
  PixelCoder coder{};
  bool compressed = false;  // the frame buffer
  int tile_width = 32, tile_height = 32;
  std::uint64_t line_bytes = 64;  // of the L2
  int signature_bits = 64;        // kept bits of a signature; of each square of a block at most 24
};

// Layout of History in memory, by offset, one array after the other:
//
//   colours     the frame buffer: pixels row by row, or blocks at their places and then their headers, tile by tile
//               (tile_store.h); or pixels of 16 bytes (HistoryColors::kApart)
//   states      History::kBlockBytes a block, tile by tile
//   records     cells (packed_records.h)
//   signatures  kSignatureBytes a block, row by row
//   contrast    History::kContrastBytes a block, in squares of 8x8 blocks: a tile of 32x32 pixels writes one burst
//
// Invariants (cited by the tests):
//   HM1  A requested block of a compressed frame buffer is read whole, as it is stored; a raw block is read by
//        the requested rows.
//   HM2  Of blocks without any surface only the states are read.
class HistoryMemory {
 public:
  static constexpr std::uint64_t kSignatureBytes = 16;
  static constexpr int kContrastSide = 8;  // of squares, in blocks

  HistoryMemory(const HistoryStorage& how, const ResolveSettings& settings, IntRect region);

  // Number of pixels of the frame buffer that are decoded, or first decompressed, for a rectangle of colours.
  std::uint64_t decoded_pixels(IntRect pixels) const;
  std::uint64_t decompressed_pixels(IntRect pixels) const;

  // Rectangles are of pixels inside the region, or of its blocks (in 4x4 pixels of the frame).
  void touch_colors(const History& of, IntRect pixels, TouchedBursts& out) const;
  void touch_records(const History& of, IntRect pixels, TouchedBursts& out) const;
  void touch_states(IntRect blocks, TouchedBursts& out) const;
  void touch_signature(int column, int row, TouchedBursts& out) const;
  void touch_contrast(IntRect blocks, TouchedBursts& out) const;
  // A cell of `bytes` that will be written.
  void touch_cell(std::size_t cell, std::uint64_t bytes, TouchedBursts& out) const;

  // Blocks that hold the pixels.
  static IntRect blocks_of(IntRect pixels) {
    if (pixels.empty()) return {};
    return {pixels.x0 / 4, pixels.y0 / 4, (pixels.x1 - 1) / 4 + 1, (pixels.y1 - 1) / 4 + 1};
  }
  IntRect blocks() const { return blocks_; }  // that the region touches
  // Cells lie within tiles.
  int cell_column(int block_column) const { return cell_of(block_column, how_.tile_width); }
  int cell_row(int block_row) const { return cell_of(block_row, how_.tile_height); }
  std::size_t cell(int column, int row) const { return cells_.index(column, row); }
  std::size_t cell_count() const { return cells_.index(cells_.x0, cells_.y1); }
  std::size_t stored_blocks() const { return stored_.index(stored_.x0, stored_.y1); }  // of a compressed frame buffer

 private:
  static int cell_of(int block, int tile) {
    const int in_tile = tile / 4, cells = (in_tile + kCellSide - 1) / kCellSide;
    return block / in_tile * cells + block % in_tile / kCellSide;
  }
  // Index in an array that is stored tile by tile; each tile has `columns` by `rows` elements.
  std::uint64_t by_tile(int column, int row, int columns, int rows) const {
    const std::uint64_t tile = tiles_.index(column / columns, row / rows);
    return (tile * static_cast<std::uint64_t>(rows) + static_cast<std::uint64_t>(row % rows)) *
               static_cast<std::uint64_t>(columns) +
           static_cast<std::uint64_t>(column % columns);
  }
  void touch_stored(const History& of, int column, int row, IntRect pixels, TouchedBursts& out) const;

  HistoryStorage how_;
  HistoryColors colors_;
  IntRect region_, blocks_, tiles_, stored_, cells_, squares_;
  std::uint64_t headers_at_ = 0, states_at_ = 0, records_at_ = 0, signatures_at_ = 0, contrast_at_ = 0;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::HistoryCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::HistoryCounters> = std::to_array<
    CounterField<tilecore::HistoryCounters>>({
    {"resolve.history_color_bytes", &tilecore::HistoryCounters::color_bytes, Combine::kSum, "bytes",
     "Colours of the previous frame that tiles requested, in lines of the L2 or in bursts, each once for a tile.", ""},
    {"resolve.history_record_bytes", &tilecore::HistoryCounters::record_bytes, Combine::kSum, "bytes",
     "Likewise depths and surfaces.", ""},
    {"resolve.history_state_bytes", &tilecore::HistoryCounters::state_bytes, Combine::kSum, "bytes",
     "Likewise bytes of blocks, those around the tile included, and their contrast.", ""},
    {"resolve.history_signature_bytes", &tilecore::HistoryCounters::signature_bytes, Combine::kSum, "bytes",
     "Likewise signatures of blocks.", ""},
    {"resolve.history_records_written", &tilecore::HistoryCounters::records_written, Combine::kSum, "bytes",
     "Depths and surfaces that tiles wrote for the next frame, in bursts.", ""},
    {"resolve.history_states_written", &tilecore::HistoryCounters::states_written, Combine::kSum, "bytes",
     "Likewise bytes of blocks, and their contrast.", ""},
    {"resolve.history_signatures_written", &tilecore::HistoryCounters::signatures_written, Combine::kSum, "bytes",
     "Likewise signatures of blocks.", ""},
    {"resolve.blocks_kept", &tilecore::HistoryCounters::blocks_kept, Combine::kSum, "blocks",
     "Blocks that were neither read nor written: the frame buffer holds them.", ""},
    {"resolve.wrong_blocks", &tilecore::HistoryCounters::wrong_blocks, Combine::kSum, "blocks",
     "Blocks with the same signature as in the previous frame although their pixels differ: the image is wrong there.",
     ""},
    {"resolve.block_hashed_bytes", &tilecore::HistoryCounters::hashed_bytes, Combine::kSum, "bytes",
     "Bytes hashed for signatures of blocks.", ""},
    {"resolve.history_pixels_decoded", &tilecore::HistoryCounters::pixels_decoded, Combine::kSum, "pixels",
     "Pixels of the previous frame whose codes were turned into linear light, in all rectangles that tiles requested.",
     ""},
    {"resolve.history_pixels_decompressed", &tilecore::HistoryCounters::pixels_decompressed, Combine::kSum, "pixels",
     "Likewise pixels of whole compressed blocks.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::HistoryCounters);

}  // namespace tessera
