// Contrast of blocks, from frame to frame.
#include <algorithm>
#include <cmath>

#include "tilecore/resolve/block_contrast.h"
#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/resolve_unit.h"

namespace tessera::tilecore {

// The largest of the bytes of the blocks that the block lay in; what nobody looked at, an edge, is left out.
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
    if (block.rests()) {  // what a kept block leaves, and what others at rest leave, is the same
      kept = then->contrast[then->block(block.pixels.x0, block.pixels.y0)];
      continue;
    }
    if (!block.leaves_contrast || block.exists != kFullBlock) continue;
    const MeasuredContrast measured =
        measure_contrast(&colors_[surfaces_.index(block.pixels.x0, block.pixels.y0)], surfaces_.pixels.width(),
                         static_cast<BlockMask>(block.rendered | block.advected), counters_.contrast_operations);
    kept = contrast_code(measured.contrast / block.left_by_blur);
    // A sixteenth of what was known is forgotten in each frame that cannot see it.
    if (!measured.known_enough)
      kept = std::max(kept, static_cast<std::uint8_t>(block.last_contrast - block.last_contrast / 16));
  }
}

// What of a square is all kept is neither read nor written; what is at rest in another is read before that is written.
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
