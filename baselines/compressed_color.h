#pragma once

#include <array>
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
// Colours are the results of pixel-shader invocations; blended ones are mixed in 8 bits. Each known word of a G-buffer is compressed as a
// colour is, and its other words are raw; layers that wait for its light have blocks of their own.
//
// Invariants (cited by the tests):
//   CC1  Every read of a block follows a write of it, with the same number of bursts.
//   CC2  Depth moves as in ImmediateMemory with the same cache.
class CompressedColorMemory {
 public:
  // `data`, `loads`: as of ImmediateMemory. Colours of more than 4 bytes compress as well as they do in 4
  // [assumed, in its favour].
  CompressedColorMemory(std::uint64_t cache_bytes, std::uint64_t burst_bytes, const SampleLayout& layout,
                        const LineData& data = {}, bool loads = false);
  // As of ImmediateMemory.
  void know_depths(const std::vector<bool>& lines);

  // `colors`: TileDrawing::colors.
  void draw(const LineTouch& touch, std::span<const ColorWrite> writes, std::span<const std::uint32_t> colors);
  // Writes back the cache; `resolve` first reads the colour, or the G-buffer with its depths and layers.
  void finish(bool resolve);

  std::uint64_t bytes_read() const { return bytes_read_; }
  std::uint64_t bytes_written() const { return bytes_written_; }
  // Colours of all lines, sample by sample; with a G-buffer its first words.
  std::span<const std::uint32_t> colors() const {
    return std::span(surfaces_[kColors].words).first(std::size_t{lines_} * line_samples_);
  }

 private:
  static constexpr std::uint32_t kBlockLines = 4;
  static constexpr std::size_t kColors = 0, kLayers = 1;
  // Colours or a G-buffer, or the layers that wait for its light.
  struct Surface {
    std::uint64_t line_bursts = 1;      // of a line in memory
    std::size_t known = 1;              // words of a sample whose values are known
    std::uint64_t copies = 1, raw = 0;  // codes of a known word that a block takes; words beside them
    std::vector<bool> drawn;            // by block
    std::vector<std::uint8_t> bursts;   // bursts of each block in memory
    std::vector<std::uint32_t> words;   // word by word, of all lines
  };
  std::uint32_t blocks() const { return lines_ / kBlockLines; }
  std::uint32_t key_of_block(std::size_t surface, std::uint32_t block) const {
    return lines_ + static_cast<std::uint32_t>(surface) * blocks() + block;
  }
  void use(std::uint32_t key, bool change);
  void write_back(std::uint32_t key);
  void use_metadata(std::uint32_t key, bool change);
  std::uint64_t coded_bytes(const Surface& surface, std::uint32_t block) const;
  std::uint64_t whole_block_bytes(const Surface& surface) const {
    return kBlockLines * std::uint64_t{line_samples_} * 4 * surface.line_bursts;
  }

  std::uint64_t burst_bytes_;
  bool lights_;  // a G-buffer, which is lit in the end
  std::uint32_t lines_, line_samples_;
  memory::LruCache cache_, metadata_;
  std::vector<bool> depth_in_memory_, metadata_in_memory_;
  std::array<Surface, 2> surfaces_;
  bool depths_known_ = false;
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
