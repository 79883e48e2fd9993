#pragma once

#include <algorithm>
#include <cstdint>

#include "base/round_up.h"
#include "timing/work.h"

namespace tessera::timing {

// Addresses of a frame's data in the external memory: first the lines that go through the L2 (records, textures,
// tables), then tile lists, the frame buffer tile by tile, patches that the front end streams, and bytes that belong
// to no round. Each part begins at a multiple of 1 MiB.
//
// Invariants (cited by the tests):
//   ML1  No two parts overlap, nor do two tiles within a part.
class MemoryLayout {
 public:
  // Lines from this number on, cells of procedures and the history, keep their addresses and do not enlarge the first part.
  static constexpr std::uint32_t kFarLines = 3u << 30;

  MemoryLayout(const FrameWork& work, std::uint64_t line_bytes) {
    std::uint64_t lines = 0, tiles = 0, read = 0, written = 0, patches = 0, entries = 0;
    const auto see = [&lines](const std::vector<std::uint32_t>& numbers) {
      for (const std::uint32_t line : numbers)
        if (line < kFarLines) lines = std::max(lines, std::uint64_t{line} + 1);
    };
    for (const WorkRound& round : work.rounds) {
      see(round.geometry_lines);
      patches = std::max(patches, round.geometry.dram_bytes);
      entries = std::max(entries, round.geometry.written_bytes);
      for (std::size_t t = 0; t < round.items.size(); ++t) {
        const TileItems& items = round.items[t];
        see(items.lines);
        see(items.texel_lines);
        tiles = std::max(tiles, std::uint64_t{round.tiles[t].tile} + 1);
        read = std::max(read, items.list_bytes + items.load_bytes + items.record_bytes);
        written = std::max({written, items.written_bytes, items.resolve_bytes});
      }
    }
    list_bytes_ = round_up(read, kTileAlignment);
    pixel_bytes_ = round_up(written, kTileAlignment);
    lists_ = round_up(lines * line_bytes, kAlignment);
    pixels_ = lists_ + round_up(std::max(tiles * list_bytes_, entries), kAlignment);
    patches_ = pixels_ + round_up(tiles * pixel_bytes_, kAlignment);
    other_ = patches_ + round_up(patches, kAlignment);
  }

  std::uint64_t entries() const { return lists_; }  // where the binner writes entries
  std::uint64_t list_of(std::uint32_t tile) const { return lists_ + tile * list_bytes_; }
  std::uint64_t pixels_of(std::uint32_t tile) const { return pixels_ + tile * pixel_bytes_; }
  std::uint64_t patches() const { return patches_; }
  std::uint64_t other() const { return other_; }

 private:
  static constexpr std::uint64_t kAlignment = std::uint64_t{1} << 20, kTileAlignment = 256;

  std::uint64_t list_bytes_ = 0, pixel_bytes_ = 0, lists_ = 0, pixels_ = 0, patches_ = 0, other_ = 0;
};

}  // namespace tessera::timing
