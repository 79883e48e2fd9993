#include "tilecore/resolve/compressed_store.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "base/vec.h"
#include "tilecore/resolve/frame_compression.h"
#include "tilecore/resolve/multisample_resolve.h"

namespace tessera::tilecore {
namespace {

constexpr int kWidth = 8, kHeight = 4;

void charge_block(const Image& color, IntRect region, IntRect block, std::uint64_t burst_bytes,
                  CompressionCounters& counters) {
  const IntRect inside = block.intersect(region);
  std::uint64_t raw = 0;
  for (int y = inside.y0; y < inside.y1; ++y)
    raw += memory::burst_bytes(region.index(inside.x0, y) * kFramePixelBytes,
                               static_cast<std::uint64_t>(inside.width()) * kFramePixelBytes, burst_bytes);
  ++counters.frame_blocks;
  counters.frame_bytes_raw += raw;
  if (inside != block) {
    ++counters.frame_blocks_raw;
    counters.frame_bytes_compressed += raw;
    return;
  }
  std::array<std::uint16_t, 4 * kWidth * kHeight> halves;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto pixel = color.at(block.x0 - region.x0 + x, block.y0 - region.y0 + y);
      const auto bits = half_bits(Vec4(pixel[0], pixel[1], pixel[2], pixel[3]));
      std::copy(bits.begin(), bits.end(), halves.begin() + 4 * (y * kWidth + x));
    }
  const std::size_t bytes = compressed_block_bytes(halves, kWidth, kHeight, burst_bytes);
  counters.frame_blocks_raw += bytes == kWidth * kHeight * kFramePixelBytes;
  counters.frame_bytes_compressed += bytes;
}

}  // namespace

void charge_compressed_frame(const Image& color, IntRect region, std::uint64_t burst_bytes,
                             CompressionCounters& counters, memory::Ledger& ledger) {
  const int x0 = region.x0 / kWidth, x1 = (region.x1 + kWidth - 1) / kWidth, y0 = region.y0 / kHeight,
            y1 = (region.y1 + kHeight - 1) / kHeight;
  PerThread<CompressionCounters> parts;
  parallel_for(static_cast<std::size_t>(y1 - y0), [&](std::size_t row) {
    const int y = (y0 + static_cast<int>(row)) * kHeight;
    for (int x = x0 * kWidth; x < x1 * kWidth; x += kWidth)
      charge_block(color, region, {x, y, x + kWidth, y + kHeight}, burst_bytes, parts.local());
  });
  CompressionCounters frame;
  parts.for_each([&](const CompressionCounters& part) { tessera::merge(frame, part); });
  frame.frame_bytes_compressed += block_header_bytes(frame.frame_blocks, burst_bytes);
  ledger.write(memory::Unit::kResolve, memory::Purpose::kFrameBuffer, frame.frame_bytes_compressed);
  tessera::merge(counters, frame);
}

}  // namespace tessera::tilecore
