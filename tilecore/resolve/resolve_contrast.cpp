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
  const auto column = [&](int x) { return x / 4 - history.region.x0 / 4; };
  const auto row = [&](int y) { return y / 4 - history.region.y0 / 4; };
  const IntRect blocks{column(there.x0), row(there.y0), column(there.x1 - 1) + 1, row(there.y1 - 1) + 1};
  contrast_rects_.push_back(blocks);
  for (int y = blocks.y0; y < blocks.y1; ++y)
    for (int x = blocks.x0; x < blocks.x1; ++x)
      block.last_contrast =
          std::max(block.last_contrast, history.contrast[static_cast<std::size_t>(y * history.block_columns() + x)]);
  return contrast_of(block.last_contrast);
}

void ResolveUnit::keep_contrast(ResolveFrame& resolve) {
  if (!reads_contrast(resolve.settings)) return;
  History& next = *resolve.next;
  for (const Block& block : blocks_) {
    std::uint8_t& kept = next.contrast[next.block(block.pixels.x0, block.pixels.y0)];
    kept = kUnknownContrast;
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

// Its bytes lie behind the records of pixels, in squares of 8x8 blocks: what a tile of 32x32 pixels writes is a burst.
void ResolveUnit::charge_contrast(const ResolveFrame& resolve, Memory memory) {
  constexpr auto kUnit = memory::Unit::kResolve;
  constexpr auto kPurpose = memory::Purpose::kHistory;
  const History& next = *resolve.next;
  constexpr int kSide = 8;
  const std::uint64_t first = next.memory.size() * (History::kPlaneBytes + History::kPixelRecordsBytes);
  const IntRect squares{0, 0, (next.block_columns() + kSide - 1) / kSide, (next.block_rows() + kSide - 1) / kSide};
  const std::uint64_t bytes = kSide * kSide * History::kContrastBytes;
  const auto squares_of = [](const IntRect& blocks) {
    return IntRect{blocks.x0 / kSide, blocks.y0 / kSide, (blocks.x1 - 1) / kSide + 1, (blocks.y1 - 1) / kSide + 1};
  };
  for (IntRect& rect : contrast_rects_) rect = squares_of(rect);
  if (resolve.previous.history != nullptr) {
    touched_.start({squares, bytes, first}, memory.burst_bytes, contrast_rects_);
    touched_.read(ledger_, kUnit, kPurpose);
  }
  const IntRect& tile = surfaces_.pixels;
  const int x0 = next.region.x0 / 4, y0 = next.region.y0 / 4;
  const IntRect written =
      squares_of({tile.x0 / 4 - x0, tile.y0 / 4 - y0, (tile.x1 + 3) / 4 - x0, (tile.y1 + 3) / 4 - y0});
  for (int y = written.y0; y < written.y1; ++y)
    for (int x = written.x0; x < written.x1; ++x)
      ledger_.write_at(kUnit, kPurpose, first + squares.index(x, y) * bytes,
                       std::min<std::uint64_t>(bytes, blocks_.size() * History::kContrastBytes), memory.burst_bytes);
}

}  // namespace tessera::tilecore
