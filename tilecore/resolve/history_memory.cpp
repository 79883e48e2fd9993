#include "tilecore/resolve/history_memory.h"

#include <algorithm>

#include "base/round_up.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::tilecore {
namespace {

constexpr std::uint64_t kArrayAlignment = 256;
constexpr std::uint64_t kUnknownCellBytes = 16 * History::kPlaneBytes;

std::uint64_t count_of(const IntRect& rect) { return rect.index(rect.x0, rect.y1); }

// Columns and rows of tiles, or blocks, that a rectangle of pixels touches.
IntRect touched(IntRect pixels, int width, int height) {
  return {pixels.x0 / width, pixels.y0 / height, (pixels.x1 - 1) / width + 1, (pixels.y1 - 1) / height + 1};
}

}  // namespace

HistoryMemory::HistoryMemory(const HistoryStorage& how, const ResolveSettings& settings, IntRect region)
    : how_(how), colors_(settings.colors), region_(region) {
  const BlockShape shape = stored_block(how.coder.format());
  blocks_ = touched(region, 4, 4);
  tiles_ = touched(region, how.tile_width, how.tile_height);
  stored_ = touched(region, shape.width, shape.height);
  cells_ = {cell_column(blocks_.x0), cell_row(blocks_.y0), cell_column(blocks_.x1 - 1) + 1,
            cell_row(blocks_.y1 - 1) + 1};
  const auto behind = [](std::uint64_t at, std::uint64_t bytes) { return round_up(at + bytes, kArrayAlignment); };
  const std::uint64_t pixels = count_of(region), blocks = count_of(blocks_);
  const auto in_tiles = [&](int width, int height) {
    return count_of(tiles_) * static_cast<std::uint64_t>(how.tile_width / width) *
           static_cast<std::uint64_t>(how.tile_height / height);
  };
  if (colors_ == HistoryColors::kApart) {
    states_at_ = behind(0, pixels * kApartColorBytes);
  } else if (how.compressed) {
    headers_at_ = count_of(stored_) * shape.raw_bytes();
    states_at_ = behind(headers_at_, in_tiles(shape.width, shape.height) * kBlockHeaderBytes);
  } else {
    const TouchedBursts::Array rows = frame_rows(how.coder.pixel_bytes(), region, how.burst_bytes);
    states_at_ = behind(0, static_cast<std::uint64_t>(region.height()) * rows.row_bytes());
  }
  records_at_ = behind(states_at_, in_tiles(4, 4) * History::kBlockBytes);
  signatures_at_ = behind(records_at_, cell_count() * kCellBytes);
  squares_ = touched(blocks_, kContrastSide, kContrastSide);
  contrast_at_ = behind(signatures_at_, blocks * kSignatureBytes);
}

void HistoryMemory::touch_stored(const History& of, int column, int row, IntRect pixels, TouchedBursts& out) const {
  const BlockShape shape = stored_block(how_.coder.format());
  const std::size_t number = stored_.index(column, row);
  const std::uint64_t raw = shape.raw_bytes(), at = number * raw,
                      bytes = of.payload.size() == stored_blocks() ? of.payload[number] : raw;
  out.touch(headers_at_ + kBlockHeaderBytes *
                              by_tile(column, row, how_.tile_width / shape.width, how_.tile_height / shape.height),
            kBlockHeaderBytes);
  // A raw block that the region cuts has fewer rows.
  const IntRect block{column * shape.width, row * shape.height, (column + 1) * shape.width, (row + 1) * shape.height};
  if (bytes < raw) {
    const IntRect inside = block.intersect(region_);
    const std::uint64_t row_bytes = static_cast<std::uint64_t>(shape.width) * how_.coder.pixel_bytes();
    const std::uint64_t rows = static_cast<std::uint64_t>(inside.height()) * row_bytes;
    if (bytes < rows || inside == block) return out.touch(at, bytes);
  }
  const IntRect inside = block.intersect(pixels);
  out.touch({block, how_.coder.pixel_bytes(), at}, inside);
}

void HistoryMemory::touch_contrast(IntRect blocks, TouchedBursts& out) const {
  if (blocks.empty()) return;
  constexpr auto kBlocks = static_cast<std::uint64_t>(kContrastSide);
  const IntRect squares = touched(blocks, kContrastSide, kContrastSide);
  for (int row = squares.y0; row < squares.y1; ++row)
    for (int column = squares.x0; column < squares.x1; ++column) {
      const IntRect inside = blocks.intersect(
          {column * kContrastSide, row * kContrastSide, (column + 1) * kContrastSide, (row + 1) * kContrastSide});
      const auto first = static_cast<std::uint64_t>(inside.y0 % kContrastSide),
                 last = static_cast<std::uint64_t>((inside.y1 - 1) % kContrastSide);
      const std::uint64_t at = contrast_at_ + squares_.index(column, row) * kBlocks * kBlocks * History::kContrastBytes;
      out.touch(at + first * kBlocks * History::kContrastBytes, (last + 1 - first) * kBlocks * History::kContrastBytes);
    }
}

void HistoryMemory::touch_colors(const History& of, IntRect pixels, TouchedBursts& out) const {
  if (pixels.empty()) return;
  if (colors_ == HistoryColors::kApart) return out.touch({region_, kApartColorBytes, 0}, pixels);
  if (!how_.compressed) return out.touch(frame_rows(how_.coder.pixel_bytes(), region_, how_.burst_bytes), pixels);
  const BlockShape shape = stored_block(how_.coder.format());
  const IntRect stored = touched(pixels, shape.width, shape.height);
  for (int row = stored.y0; row < stored.y1; ++row)
    for (int column = stored.x0; column < stored.x1; ++column) touch_stored(of, column, row, pixels, out);
}

std::uint64_t HistoryMemory::decoded_pixels(IntRect pixels) const {
  return colors_ == HistoryColors::kApart || !how_.coder.tone_maps() || pixels.empty() ? 0 : count_of(pixels);
}

std::uint64_t HistoryMemory::decompressed_pixels(IntRect pixels) const {
  if (colors_ == HistoryColors::kApart || !how_.compressed || pixels.empty()) return 0;
  const BlockShape shape = stored_block(how_.coder.format());
  return count_of(touched(pixels, shape.width, shape.height)) * shape.pixels();
}

void HistoryMemory::touch_records(const History& of, IntRect pixels, TouchedBursts& out) const {
  if (pixels.empty()) return;
  const IntRect touched_blocks = touched(pixels, 4, 4);
  for (int row = touched_blocks.y0; row < touched_blocks.y1; ++row)
    for (int column = touched_blocks.x0; column < touched_blocks.x1; ++column) {
      const std::size_t b = blocks_.index(column, row);
      if (of.empty_block(b)) continue;
      const std::size_t number = cell(cell_column(column), cell_row(row));
      touch_cell(number, of.cells.size() == cell_count() ? of.cells[number] : kUnknownCellBytes, out);
    }
}

void HistoryMemory::touch_states(IntRect blocks, TouchedBursts& out) const {
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column)
      out.touch(states_at_ + by_tile(column, row, how_.tile_width / 4, how_.tile_height / 4) * History::kBlockBytes,
                History::kBlockBytes);
}

void HistoryMemory::touch_signature(int column, int row, TouchedBursts& out) const {
  out.touch(signatures_at_ + blocks_.index(column, row) * kSignatureBytes, kSignatureBytes);
}

void HistoryMemory::touch_cell(std::size_t number, std::uint64_t bytes, TouchedBursts& out) const {
  out.touch(records_at_ + number * kCellBytes, bytes);
}

}  // namespace tessera::tilecore
