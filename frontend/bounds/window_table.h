#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "base/vec.h"
#include "frontend/bounds/window_places.h"
#include "frontend/record_lines.h"
#include "memory/ledger.h"
#include "memory/line_cache.h"

namespace tessera::frontend {

// A closed range of values.
struct ValueRange {
  float low = 0, high = 0;

  ValueRange hull(const ValueRange& o) const { return {std::min(low, o.low), std::max(high, o.high)}; }
  float largest() const { return std::max(std::abs(low), std::abs(high)); }
};

// The fetches that bounding makes besides the base patch itself, each through an on-chip cache: table entries and
// texels by lines, records of neighbouring base patches whole. Counts the bytes of misses and keeps the missed lines.
//
// Invariants (cited by the tests):
//   BFT1  A line costs its bytes when it is not among the last used of its set, a record its bytes when it is not among
//        the last `records` used; otherwise nothing.
class HeightTableCache {
 public:
  struct Caches {
    std::int64_t bytes, ways, line_bytes;  // of lines: as memory::LineCache
    std::int64_t records;
  };
  explicit HeightTableCache(const Caches& caches)
      : lines_(caches.bytes, caches.ways, caches.line_bytes),
        records_(caches.records, std::max<std::int64_t>(caches.records, 1), 1),
        line_bytes_(static_cast<std::uint64_t>(caches.line_bytes)) {}

  void fetch(std::uint64_t address) {
    if (postponed_ != nullptr) {
      postponed_->push_back(address);
      return;
    }
    const auto line = static_cast<std::uint32_t>(address / line_bytes_);
    if (lines_.use(line)) return;
    table_bytes_ += line_bytes_;
    missed_.push_back(line);
  }
  // From here on line fetches are appended to `addresses` instead, until the call with null. For results that are
  // computed ahead and may not be used.
  void postpone(std::vector<std::uint64_t>* addresses) { postponed_ = addresses; }
  // `elements`: number of elements that decoding the record gives.
  void fetch_record(std::uint32_t record, std::uint64_t bytes, std::uint64_t elements) {
    if (records_.use(record)) return;
    missed_records_.push_back({record, bytes});
    record_bytes_ += memory::burst_bytes(0, bytes, line_bytes_);
    elements_ += elements;
  }
  // Puts into the cache a record that another unit reads anyway.
  void pass_record(std::uint32_t record) { (void)records_.use(record); }

  // Lines missed since the last call, in order.
  std::vector<std::uint32_t> take_missed_lines() { return std::exchange(missed_, {}); }
  // Records missed since the last call, in order.
  std::vector<RecordRead> take_missed_records() { return std::exchange(missed_records_, {}); }
  // Bytes that no call has taken yet.
  std::uint64_t pending_bytes() const { return table_bytes_ + record_bytes_; }
  // Bytes fetched since the last call.
  std::uint64_t take_table_bytes() { return std::exchange(table_bytes_, 0); }
  std::uint64_t take_record_bytes() { return std::exchange(record_bytes_, 0); }
  // Elements decoded since the last call.
  std::uint64_t take_elements() { return std::exchange(elements_, 0); }

 private:
  memory::LineCache lines_, records_;
  std::uint64_t line_bytes_, table_bytes_ = 0, record_bytes_ = 0, elements_ = 0;
  std::vector<std::uint32_t> missed_;
  std::vector<RecordRead> missed_records_;
  std::vector<std::uint64_t>* postponed_ = nullptr;
};

// Smallest and largest value over any rectangle of a grid: a sparse table of square windows whose sides are powers of
// two. Windows of one side overlap: a query joins as few as cover the rectangle, mostly four.
//
// Invariants (cited by the tests):
//   WT1  over() holds the value of every texel in the rectangle.
//   WT2  It holds no texel farther outside than one less than the step between windows on each side:
//        side / kWindowsPerSide of a window no larger than the rectangle's shorter side, unless the longer one is more
//        than four times as long. Rectangles with sides below 2 * kWindowsPerSide are exact, but for those one texel
//        wide.
//   WT3  There are no more than three entries to a texel.
class WindowTable {
 public:
  static constexpr int kWindowsPerSide = 4;
  static constexpr std::uint64_t kEntryBytes = sizeof(ValueRange);
  static constexpr std::uint64_t kMaxBytesPerTexel = 3 * kEntryBytes;

  // `value` returns the range of texel (x, y); many threads call it.
  WindowTable(int width, int height, const std::function<ValueRange(int, int)>& value);

  // Ends inclusive, inside the grid.
  ValueRange over(int x0, int y0, int x1, int y1, HeightTableCache* fetches) const;
  // Joins the windows that find_windows() found for a place of this table, as over() does for its texels.
  ValueRange joined(const WindowPlaces& places, std::size_t place, HeightTableCache* fetches) const {
    const Step& step = steps_[static_cast<std::size_t>(places.step[place])];
    return joined(step, places.s.first[place], places.t.first[place], places.s.last[place], places.t.last[place],
                  fetches);
  }
  int step_count() const { return static_cast<int>(steps_.size()); }
  ValueRange whole() const { return steps_.back().entries.front(); }
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t entry_count() const;

  // Places the table in memory from `address` on; returns the end.
  std::uint64_t place(std::uint64_t address);

 private:
  // Windows with sides of 2^log2_side, one every 2^log2_apart texels.
  struct Step {
    int log2_side, log2_apart, columns, rows;
    std::uint64_t address;
    std::vector<ValueRange> entries;
  };
  // First and last window of a step that a span of texels needs.
  struct Span {
    int first, last;
  };
  // Joins windows of [column0, column1] x [row0, row1], as few as cover them all.
  static ValueRange joined(const Step& step, int column0, int row0, int column1, int row1, HeightTableCache* fetches);
  static Span span(const Step& step, int count, int low, int high);

  int width_, height_;
  std::vector<Step> steps_;
};

}  // namespace tessera::frontend
