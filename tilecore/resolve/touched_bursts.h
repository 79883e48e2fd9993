#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "memory/ledger.h"

namespace tessera::tilecore {

// Which bursts of an array that lies row by row in memory are touched by a number of rectangles of its elements, each
// once: what a unit reads that keeps what it has read until it is finished with a tile.
class TouchedBursts {
 public:
  // `elements`: all of the array, `bytes` each.
  struct Array {
    IntRect elements;
    std::uint64_t bytes = 0;
    std::uint64_t offset = 0;  // of the first
  };

  // Forgets what was touched; `touched` are inside the array, empty ones count for nothing.
  void start(const Array& array, std::uint64_t burst_bytes, std::span<const IntRect> touched);
  void read(memory::Ledger& ledger, memory::Unit unit, memory::Purpose purpose) const;

 private:
  struct Span {
    std::uint64_t first, end;  // bursts
  };
  Span bursts_of(int y, int x0, int x1) const {
    const std::uint64_t begin = array_.offset + array_.elements.index(x0, y) * array_.bytes,
                        end = array_.offset + array_.elements.index(x1 - 1, y) * array_.bytes + array_.bytes;
    return {begin / burst_bytes_, (end + burst_bytes_ - 1) / burst_bytes_};
  }

  Array array_;
  std::uint64_t burst_bytes_ = 64;
  IntRect hull_;
  std::vector<std::uint64_t> row_first_;  // burst of each row of the hull
  std::size_t columns_ = 0;
  std::vector<std::uint8_t> touched_;  // by row of the hull, then burst
};

}  // namespace tessera::tilecore
