#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tessera::memory {

// Cache lines [first, end).
struct LineRange {
  std::uint32_t first = 0, end = 0;
  bool operator==(const LineRange&) const = default;
};

// A set-associative cache of read-only lines; the least recently used line of a set goes first. Line n is
// bytes [n, n+1) * line size of the emulated memory and belongs to set n modulo the number of sets.
//
// Invariants (cited by the tests):
//   LC1  A line hits exactly when fewer than `ways` other lines of its set were used since it was.
//   LC2  Results depend on the sequence of lines alone.
class LineCache {
 public:
  // The number of sets must be a power of two (check_gpu() sees to it). A cache of 0 bytes never hits.
  LineCache(std::int64_t bytes, std::int64_t ways, std::int64_t line_bytes)
      : ways_(static_cast<std::size_t>(ways)),
        sets_(static_cast<std::size_t>(bytes / (ways * line_bytes))),
        lines_(ways_ * sets_, kNone) {}

  void empty() { std::fill(lines_.begin(), lines_.end(), kNone); }

  // Uses a line. A miss returns false and fills the line.
  bool use(std::uint32_t line) {
    if (sets_ == 0) return false;
    std::uint32_t* set = &lines_[(line & (sets_ - 1)) * ways_];
    if (set[0] == line) return true;
    std::size_t way = 1;
    while (way < ways_ && set[way] != line) ++way;
    const bool hit = way < ways_;
    // Newest first.
    for (std::size_t k = hit ? way : ways_ - 1; k > 0; --k) set[k] = set[k - 1];
    set[0] = line;
    return hit;
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  std::size_t ways_, sets_;
  std::vector<std::uint32_t> lines_;
};

}  // namespace tessera::memory
