#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/tile_drawing.h"
#include "memory/lru_cache.h"

namespace tessera::baselines {

// The memory of an immediate-mode machine, as ImmediateMemory, but with colour in compressed blocks of four lines
// [spec: 256 bytes, AMD's delta colour compression]. A block on chip is whole, so a missing block is read before it
// is changed; a block that leaves is compressed and written in as many bursts as it takes. A byte of metadata per
// block gives that number (0: clear, nothing to read). Metadata is in memory, too, behind a cache of its own of one
// sixteenth of the on-chip bytes [assumed].
//
// Colours are the results of pixel-shader invocations; blended ones are mixed in 8 bits.
//
// Invariants (cited by the tests):
//   CC1  Every read of a block follows a write of it, with the same number of bursts.
//   CC2  Depth moves as in ImmediateMemory with the same cache.
class CompressedColorMemory {
 public:
  // `color_bursts`, `loads`: as of ImmediateMemory. Colours of more than 4 bytes compress as well as they do in 4
  // [assumed, in its favour].
  CompressedColorMemory(std::uint64_t cache_bytes, std::uint64_t burst_bytes, const SampleLayout& layout,
                        std::uint64_t color_bursts = 1, bool loads = false);

  void draw(const LineTouch& touch, std::span<const ColorWrite> writes, std::span<const std::uint32_t> colors);
  // Writes back the cache; `resolve` reads the colour first.
  void finish(bool resolve);

  std::uint64_t bytes_read() const { return bytes_read_; }
  std::uint64_t bytes_written() const { return bytes_written_; }
  // Colours of all lines, sample by sample.
  std::span<const std::uint32_t> colors() const { return colors_; }

 private:
  static constexpr std::uint32_t kBlockLines = 4;
  std::uint32_t key_of_block(std::uint32_t block) const { return lines_ + block; }
  void use(std::uint32_t key, bool change);
  void write_back(std::uint32_t key);
  void use_metadata(std::uint32_t block, bool change);
  std::span<const std::uint32_t> block_colors(std::uint32_t block) const;

  std::uint64_t whole_block_bytes() const { return kBlockLines * std::uint64_t{line_samples_} * 4 * color_bursts_; }

  std::uint64_t burst_bytes_, color_bursts_;
  std::uint32_t lines_, line_samples_;
  memory::LruCache cache_, metadata_;
  std::vector<bool> depth_in_memory_, drawn_, metadata_in_memory_;
  std::vector<std::uint8_t> bursts_;  // bursts of each block in memory
  std::vector<std::uint32_t> colors_;
  std::uint64_t bytes_read_ = 0, bytes_written_ = 0;
};

// A block of colours (RGBA8, red in the lowest byte), compressed without loss as delta colour compression does.
//
//   a byte, the kind: 0 constant, 1 deltas, 2 as they are
//   constant: the colour (4)
//   deltas: per channel the least value (1), per channel the width of the differences from it (1, 0 to 8); then the
//     differences, bit by bit without a gap, each channel with its width
//   as they are: the colours (4 each)
std::vector<std::uint8_t> encode_colors(std::span<const std::uint32_t> colors);
std::vector<std::uint32_t> decode_colors(std::span<const std::uint8_t> bytes, std::size_t count);

// Length of encode_colors(colors).
std::size_t color_code_bytes(std::span<const std::uint32_t> colors);

}  // namespace tessera::baselines
