// The resolve unit and memory: unchanged blocks, reads and writes of the history.
#include <algorithm>
#include <cmath>
#include <span>

#include "base/check.h"
#include "base/round_up.h"
#include "tilecore/resolve/block_contrast.h"
#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/frame_compression.h"
#include "tilecore/resolve/resolve_unit.h"

namespace tessera::tilecore {
namespace {

// Motion in pixels up to which a block sees only pixels of the blocks around it.
constexpr float kNearMotion = 3.0f;

std::size_t place_in_block(int x, int y) { return static_cast<std::size_t>(4 * (y & 3) + (x & 3)); }

}  // namespace

// ---- Blocks that stay as they are -------------------------------------------------------------------------------

// Cheap evidence first: nothing moves, and all that is not shaded is a copy.
bool ResolveUnit::may_stay(const ResolveFrame& resolve, const Block& block) const {
  if (!resolve.keeps_blocks || resolve.previous.history == nullptr || block.discrepant || block.lost != 0) return false;
  return block.copied ? block.seen == block.exists : block.seen == 0 && resolve.previous.motion->camera_rests();
}

void ResolveUnit::compare_with_signature(ResolveFrame& resolve, const Memory& memory, Block& block, bool open) {
  const History& then = *resolve.previous.history;
  const std::size_t b = then.block(block.pixels.x0, block.pixels.y0);
  SignedBlock here, there;
  here.exists = there.exists = block.exists;
  for_each_pixel(block.pixels, [&](int x, int y) {
    const std::size_t p = place_in_block(x, y), from = surfaces_.index(x, y), to = then.pixel(x, y);
    here.codes[p] = memory.coder.code(colors_[from]);
    here.depth[p] = records_[from], here.surface[p] = surfaces_.surface[from];
    there.codes[p] = memory.coder.code(then.color[to]);
    there.depth[p] = then.depth[to], there.surface[p] = then.surface[to];
  });
  const bool same = here == there, known = then.stay[b] != History::kUnknown;
  const bool as_before =
      known && (same || matches(signature_of(here, memory.signature_bits), signature_of(there, memory.signature_bits),
                                block.exists, block.rendered));
  const std::uint64_t shaded = pixel_count(static_cast<BlockMask>(block.rendered & block.exists)),
                      all = pixel_count(block.exists);
  history_counters_.hashed_bytes += shaded * memory.coder.pixel_bytes() + all * History::kSurfaceBytes;
  if (known) signatures_read_.push_back({block.pixels.x0 / 4, block.pixels.y0 / 4});
  if (as_before && !same) {
    ++history_counters_.wrong_blocks;
    for_each_pixel(block.pixels, [&](int x, int y) { colors_[surfaces_.index(x, y)] = then.color[then.pixel(x, y)]; });
  }
  // Without a signature the colours of copied pixels are fetched, and the comparison uses them.
  const bool as_fetched = !known && block.copied && same;
  resolve.next->stay[b] = as_before || as_fetched ? History::kSettled : History::kSigned;
  block.kept = as_before && then.stay[b] == History::kSettled && !open && resolve.written[b] == 0;
  if (as_before) return;
  history_counters_.hashed_bytes += (all - shaded) * memory.coder.pixel_bytes();
  signatures_written_.push_back({block.pixels.x0 / 4, block.pixels.y0 / 4});
}

void ResolveUnit::find_unchanged_blocks(ResolveFrame& resolve, const Memory& memory, bool open) {
  signatures_read_.clear(), signatures_written_.clear();
  const IntRect& tile = surfaces_.pixels;
  unchanged_.blocks = {tile.x0 / 4, tile.y0 / 4, (tile.x1 - 1) / 4 + 1, (tile.y1 - 1) / 4 + 1};
  unchanged_.kept.assign(blocks_.size(), 0);
  unchanged_.any = false;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    Block& block = blocks_[i];
    resolve.next->stay[resolve.next->block(block.pixels.x0, block.pixels.y0)] = History::kUnknown;
    if (may_stay(resolve, block))
      compare_with_signature(resolve, memory, block, open);
    else if (resolve.keeps_blocks && block.discrepant && block.copied)  // its signature was asked first
      signatures_read_.push_back({block.pixels.x0 / 4, block.pixels.y0 / 4, 0, 0});
    unchanged_.kept[i] = block.kept;
    unchanged_.any = unchanged_.any || block.kept;
  }
  // A block of the compressed frame buffer is written whole or not at all.
  if (memory.compressed && unchanged_.any) {
    const BlockShape shape = stored_block(memory.coder.format());
    const int columns = shape.width / 4, rows = shape.height / 4;
    for (Block& block : blocks_) {
      const int column = block.pixels.x0 / 4 / columns * columns, row = block.pixels.y0 / 4 / rows * rows;
      block.kept = block.kept && unchanged_.all({column, row, column + columns, row + rows});
    }
    for (std::size_t i = 0; i < blocks_.size(); ++i) unchanged_.kept[i] = blocks_[i].kept;
  }
  for (const Block& block : blocks_) {
    if (block.copied && !block.kept) {
      looked_at_.push_back(block.pixels);
      if (block.advected != 0 || block.discrepant) fetched_.push_back(block.pixels);
    }
    history_counters_.blocks_kept += block.kept;
    if (!block.kept) resolve.written[resolve.next->block(block.pixels.x0, block.pixels.y0)] = 1;
  }
}

// ---- Traffic ----------------------------------------------------------------------------------------------------

// Sends the touched bursts to the L2.
std::uint64_t ResolveUnit::read_touched(const Memory& memory, std::uint32_t first_line) {
  std::uint64_t count = 0;
  for (const TouchedBursts::Run& run : touched_.runs()) {
    count += run.end - run.first;
    for (std::uint64_t line = run.first; line < run.end; ++line)
      lines_.push_back(first_line + static_cast<std::uint32_t>(line));
  }
  return count * memory.line_bytes;
}

void ResolveUnit::read_history(const ResolveFrame& resolve, const Memory& memory, const HistoryReads& reads) {
  const HistoryMemory places(memory, resolve.settings, reads.history.region);
  const auto of_each = [&](std::span<const IntRect> rects, const auto& touch) {
    touched_.start(memory.line_bytes);
    for (const IntRect& rect : rects) touch(rect);
    return read_touched(memory, reads.first_line);
  };
  history_counters_.state_bytes +=
      of_each(reads.states, [&](IntRect blocks) { places.touch_states(blocks.intersect(places.blocks()), touched_); });
  history_counters_.signature_bytes +=
      of_each(reads.signatures, [&](IntRect block) { places.touch_signature(block.x0, block.y0, touched_); });
  history_counters_.record_bytes +=
      of_each(reads.records, [&](IntRect rect) { places.touch_records(reads.history, rect, touched_); });
  history_counters_.color_bytes +=
      of_each(reads.colors, [&](IntRect rect) { places.touch_colors(reads.history, rect, touched_); });
  for (const IntRect& rect : reads.colors) {
    history_counters_.pixels_decoded += places.decoded_pixels(rect);
    history_counters_.pixels_decompressed += places.decompressed_pixels(rect);
  }
}

BlockRecord ResolveUnit::record_of(const Block& block) const {
  BlockRecord out;
  out.exists = block.exists;
  out.reconstructed = block.reconstructed;
  out.plane = block.plane;
  out.value = block.plane_value, out.by_x = block.plane_by_x, out.by_y = block.plane_by_y;
  if (block.plane) {
    out.surface[0] = surfaces_.surface[surfaces_.index(block.pixels.x0, block.pixels.y0)];
    return out;
  }
  for_each_pixel(block.pixels, [&](int x, int y) {
    const std::size_t p = place_in_block(x, y), pixel = surfaces_.index(x, y);
    out.surface[p] = surfaces_.surface[pixel], out.depth[p] = records_[pixel];
  });
  return out;
}

// Packs the tile's records cell by cell.
void ResolveUnit::write_cells(ResolveFrame& resolve, const HistoryMemory& places, const Memory& memory) {
  History& next = *resolve.next;
  const IntRect& tile = unchanged_.blocks;
  std::array<std::uint8_t, kCellBytes> packed;
  for (int y0 = tile.y0, y1 = 0; y0 < tile.y1; y0 = y1) {
    for (y1 = y0 + 1; y1 < tile.y1 && places.cell_row(y1) == places.cell_row(y0);) ++y1;
    for (int x0 = tile.x0, x1 = 0; x0 < tile.x1; x0 = x1) {
      for (x1 = x0 + 1; x1 < tile.x1 && places.cell_column(x1) == places.cell_column(x0);) ++x1;
      std::array<BlockRecord, kCellSide * kCellSide> cell;
      std::size_t n = 0;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) cell[n++] = record_of(blocks_[tile.index(x, y)]);
      const std::size_t number = places.cell(places.cell_column(x0), places.cell_row(y0)),
                        bytes = pack_records(std::span(cell).first(n), static_cast<std::size_t>(x1 - x0), packed);
      next.cells[number] = static_cast<std::uint16_t>(round_up(bytes, memory.burst_bytes));
      if (!unchanged_.all({x0, y0, x1, y1})) places.touch_cell(number, bytes, touched_);
    }
  }
}

void ResolveUnit::write_records(ResolveFrame& resolve, const HistoryMemory& places, const Memory& memory) {
  touched_.start(memory.burst_bytes);
  TESSERA_CHECK(resolve.next->cells.size() == places.cell_count(), "cells have their room before any tile");
  write_cells(resolve, places, memory);
  history_counters_.records_written += write_touched(memory);
}

std::uint64_t ResolveUnit::write_touched(const Memory& memory) {
  std::uint64_t bursts = 0;
  for (const TouchedBursts::Run& run : touched_.runs()) bursts += run.end - run.first;
  touched_.write(ledger_, memory::Unit::kResolve, memory::Purpose::kHistory);
  return bursts * memory.burst_bytes;
}

void ResolveUnit::charge(ResolveFrame& resolve, const Memory& memory) {
  using memory::Purpose;
  using memory::Unit;
  const ResolveSettings& settings = resolve.settings;
  const HistoryMemory places(memory, settings, resolve.next->region);
  const IntRect& tile = unchanged_.blocks;
  if (resolve.previous.history != nullptr) {
    // Decisions read the blocks around; reprojected pixels may lie farther away.
    const int around = advects(settings) ? 1 : 0;
    std::vector<IntRect> states;
    if (reads_blocks(settings))
      states.push_back({tile.x0 - around, tile.y0 - around, tile.x1 + around, tile.y1 + around});
    if (settings.rates.thresholds.reuse * (1.0f + settings.rates.thresholds.hysteresis) > kNearMotion)
      for (const IntRect& rect : looked_at_) states.push_back(HistoryMemory::blocks_of(rect));
    read_history(resolve, memory, {*resolve.previous.history, states, signatures_read_, looked_at_, fetched_, 0});
  }
  if (!eye_looked_at_.empty()) {
    std::vector<IntRect> states;
    for (const IntRect& rect : eye_looked_at_) states.push_back(HistoryMemory::blocks_of(rect));
    read_history(resolve, memory,
                 {*resolve.other_eye.history, states, {}, eye_looked_at_, eye_fetched_, kOtherEyeLine});
  }
  ledger_.read(Unit::kResolve, Purpose::kHistory, memory::burst_bytes(0, vertex_bytes_, memory.burst_bytes));
  if (resolve.keeps_records) {
    write_records(resolve, places, memory);
    if (settings.colors == HistoryColors::kApart) {
      touched_.start(memory.burst_bytes);
      places.touch_colors(*resolve.next, surfaces_.pixels, touched_);
      write_touched(memory);
    }
  } else if (settings.reach == StencilReach::kNeighbours) {  // for the second pass
    touched_.start(memory.burst_bytes);
    touched_.touch({resolve.next->region, History::kSurfaceBytes, 0}, surfaces_.pixels);
    touched_.write(ledger_, Unit::kResolve, Purpose::kNeighbours);
  }
  touched_.start(memory.burst_bytes);
  for (const IntRect& block : signatures_written_) places.touch_signature(block.x0, block.y0, touched_);
  history_counters_.signatures_written += write_touched(memory);
  if (reads_contrast(settings)) charge_contrast(places, memory);
  if (!reads_blocks(settings)) return;
  touched_.start(memory.burst_bytes);
  places.touch_states(tile, touched_);
  history_counters_.states_written += write_touched(memory);
}

// ---- Contrast of blocks, from frame to frame ---------------------------------------------------------------------

// The largest byte of the blocks that the block came from; blocks without a measurement, such as edges, are left out.
float ResolveUnit::contrast_before(const History& history, Block& block) {
  const IntRect& pixels = block.pixels;
  const Vec2 motion = velocity_.velocity()[surfaces_.index(std::min((pixels.x0 & ~3) + 2, pixels.x1 - 1),
                                                           std::min((pixels.y0 & ~3) + 2, pixels.y1 - 1))];
  constexpr float kFarthest = 1 << 20;
  if (!(std::abs(motion.x) < kFarthest && std::abs(motion.y) < kFarthest)) return contrast_of(kUnknownContrast);
  const int left = pixels.x0 - static_cast<int>(std::floor(motion.x + 0.5f)),
            top = pixels.y0 - static_cast<int>(std::floor(motion.y + 0.5f));
  const IntRect there = history.region.intersect({left, top, left + pixels.width(), top + pixels.height()});
  if (there.x0 >= there.x1 || there.y0 >= there.y1) return contrast_of(kUnknownContrast);
  const IntRect blocks = HistoryMemory::blocks_of(there);
  contrast_rects_.push_back(blocks);
  for (int y = blocks.y0; y < blocks.y1; ++y)
    for (int x = blocks.x0; x < blocks.x1; ++x)
      block.last_contrast = std::max(block.last_contrast, history.contrast[history.block(4 * x, 4 * y)]);
  return contrast_of(block.last_contrast);
}

void ResolveUnit::keep_contrast(ResolveFrame& resolve) {
  if (!reads_contrast(resolve.settings)) return;
  History& next = *resolve.next;
  const History* then = resolve.previous.history;
  for (const Block& block : blocks_) {
    std::uint8_t& kept = next.contrast[next.block(block.pixels.x0, block.pixels.y0)];
    kept = kUnknownContrast;
    if (block.rests()) {  // a kept block and others at rest leave the same byte
      kept = then->contrast[then->block(block.pixels.x0, block.pixels.y0)];
      continue;
    }
    if (!block.leaves_contrast || block.exists != kFullBlock) continue;
    const MeasuredContrast measured =
        measure_contrast(&colors_[surfaces_.index(block.pixels.x0, block.pixels.y0)], surfaces_.pixels.width(),
                         static_cast<BlockMask>(block.rendered | block.advected), counters_.contrast_operations);
    kept = contrast_code(measured.contrast / block.left_by_blur);
    // A frame that cannot measure the contrast forgets a sixteenth of the known one.
    if (!measured.known_enough)
      kept = std::max(kept, static_cast<std::uint8_t>(block.last_contrast - block.last_contrast / 16));
  }
}

// A square whose blocks are all kept is neither read nor written; another square with blocks at rest is read before it
// is written.
void ResolveUnit::charge_contrast(const HistoryMemory& places, const Memory& memory) {
  constexpr int kSide = HistoryMemory::kContrastSide;
  const IntRect& tile = unchanged_.blocks;
  written_contrast_.clear();
  for (int y = tile.y0 / kSide * kSide; y < tile.y1; y += kSide)
    for (int x = tile.x0 / kSide * kSide; x < tile.x1; x += kSide) {
      const IntRect blocks = tile.intersect({x, y, x + kSide, y + kSide});
      if (unchanged_.all(blocks)) continue;
      written_contrast_.push_back(blocks);
      if (any_rests(blocks)) contrast_rects_.push_back(blocks);
    }
  touched_.start(memory.line_bytes);
  for (const IntRect& blocks : contrast_rects_) places.touch_contrast(blocks, touched_);
  history_counters_.state_bytes += read_touched(memory, 0);
  touched_.start(memory.burst_bytes);
  for (const IntRect& blocks : written_contrast_) places.touch_contrast(blocks, touched_);
  history_counters_.states_written += write_touched(memory);
}

bool ResolveUnit::any_rests(const IntRect& blocks) const {
  for (int y = blocks.y0; y < blocks.y1; ++y)
    for (int x = blocks.x0; x < blocks.x1; ++x)
      if (blocks_[unchanged_.blocks.index(x, y)].rests()) return true;
  return false;
}

}  // namespace tessera::tilecore
