#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "base/round_up.h"
#include "memory/ledger.h"

namespace tessera::tilecore {

// The touched bursts of a memory, each once: the traffic of a unit that keeps its reads, or gathers its writes, until
// it has finished a tile.
class TouchedBursts {
 public:
  // An array that is stored row by row in memory.
  struct Array {
    IntRect elements;          // all of it
    std::uint64_t bytes = 0;   // of an element
    std::uint64_t offset = 0;  // of the first
    std::uint64_t pitch = 0;   // bytes from a row to the next; 0: rows are contiguous

    std::uint64_t row_bytes() const {
      return pitch != 0 ? pitch : static_cast<std::uint64_t>(elements.width()) * bytes;
    }
    std::uint64_t at(int x, int y) const {
      return offset + static_cast<std::uint64_t>(y - elements.y0) * row_bytes() +
             static_cast<std::uint64_t>(x - elements.x0) * bytes;
    }
  };

  // Forgets all touched bursts.
  void start(std::uint64_t burst_bytes) {
    burst_bytes_ = burst_bytes;
    spans_.clear();
  }
  void touch(std::uint64_t offset, std::uint64_t bytes) {
    if (bytes != 0) spans_.push_back({offset / burst_bytes_, (offset + bytes - 1) / burst_bytes_ + 1});
  }
  // `rect` must lie inside the array; an empty one touches no burst.
  void touch(const Array& array, IntRect rect);

  // Runs of touched bursts in the order of their addresses.
  struct Run {
    std::uint64_t first, end;
  };
  std::span<const Run> runs();

  void write(memory::Ledger& ledger, memory::Unit unit, memory::Purpose purpose);

 private:
  std::uint64_t burst_bytes_ = 64;
  std::vector<Run> spans_;  // joined and in order once runs() was called
};

// The pixels of a frame buffer that is not compressed. Rows begin at bursts.
inline TouchedBursts::Array frame_rows(std::uint64_t pixel_bytes, IntRect region, std::uint64_t burst_bytes) {
  return {region, pixel_bytes, 0, round_up(static_cast<std::uint64_t>(region.width()) * pixel_bytes, burst_bytes)};
}

}  // namespace tessera::tilecore
