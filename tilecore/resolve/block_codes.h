#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "base/rect.h"
#include "memory/ledger.h"
#include "tilecore/resolve/frame_compression.h"
#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

// Columns and rows of the blocks that a rectangle touches. Blocks lie on the grid of the image.
inline IntRect touched_blocks(const BlockShape& shape, IntRect pixels) {
  if (pixels.empty()) return {};
  return {pixels.x0 / shape.width, pixels.y0 / shape.height, (pixels.x1 + shape.width - 1) / shape.width,
          (pixels.y1 + shape.height - 1) / shape.height};
}

inline std::uint64_t pixel_count(IntRect rect) {
  return rect.empty() ? 0 : static_cast<std::uint64_t>(rect.width()) * static_cast<std::uint64_t>(rect.height());
}

// Whether a raw block is whole bursts. Others are not compressed.
inline bool compressible(const BlockShape& shape, std::uint64_t burst_bytes) {
  return shape.raw_bytes() % burst_bytes == 0;
}

// Bytes that a block takes raw: its rows inside of `pixels`, as bursts of its place.
inline std::uint64_t raw_block_bytes(const BlockShape& shape, int row, IntRect pixels, std::uint64_t burst_bytes) {
  const int first = std::max(row * shape.height, pixels.y0), last = std::min((row + 1) * shape.height, pixels.y1);
  const std::uint64_t row_bytes = static_cast<std::uint64_t>(shape.width) * shape.pixel_bytes();
  return std::min<std::uint64_t>(
      shape.raw_bytes(), memory::burst_bytes(static_cast<std::uint64_t>(first - row * shape.height) * row_bytes,
                                             static_cast<std::uint64_t>(last - first) * row_bytes, burst_bytes));
}

// Bytes that the block in `column` and `row` of a tile's `pixels` takes in memory. code(i): of pixel i of the tile, row by
// row. A block that the tile cuts is filled up with copies of its nearest pixels.
template <class Code>
std::uint64_t stored_block_bytes(const BlockShape& shape, int column, int row, IntRect pixels,
                                 std::uint64_t burst_bytes, const Code& code) {
  const std::uint64_t raw = raw_block_bytes(shape, row, pixels, burst_bytes);
  if (!compressible(shape, burst_bytes)) return raw;
  std::array<std::uint16_t, 4 * kLargestBlockPixels> codes;
  auto out = codes.begin();
  for (int y = row * shape.height; y < (row + 1) * shape.height; ++y)
    for (int x = column * shape.width; x < (column + 1) * shape.width; ++x) {
      const PixelCode near =
          code(pixels.index(std::clamp(x, pixels.x0, pixels.x1 - 1), std::clamp(y, pixels.y0, pixels.y1 - 1)));
      out = std::copy(near.begin(), near.end(), out);
    }
  return std::min<std::uint64_t>(
      raw, compressed_block_bytes(std::span(codes).first(4 * shape.pixels()), shape, burst_bytes));
}

// The code of a further sample as it is stored: its difference from the first one, channel by channel, modulo 2^N. Such
// blocks have the shape difference_block().
constexpr PixelCode difference(const PixelCode& code, const PixelCode& first, const ChannelBits& bits) {
  PixelCode out{};
  for (std::size_t c = 0; c < out.size(); ++c)
    out[c] = static_cast<std::uint16_t>((code[c] - first[c]) & ((1 << bits[c]) - 1));
  return out;
}
constexpr BlockShape difference_block(BlockShape shape) {
  shape.halves = false;
  return shape;
}

}  // namespace tessera::tilecore
