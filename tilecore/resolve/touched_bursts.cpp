#include "tilecore/resolve/touched_bursts.h"

#include <algorithm>

namespace tessera::tilecore {

void TouchedBursts::start(const Array& array, std::uint64_t burst_bytes, std::span<const IntRect> touched) {
  array_ = array, burst_bytes_ = burst_bytes;
  hull_ = {};
  for (const IntRect& rect : touched)
    if (!rect.empty())
      hull_ = hull_.empty() ? rect
                            : IntRect{std::min(hull_.x0, rect.x0), std::min(hull_.y0, rect.y0),
                                      std::max(hull_.x1, rect.x1), std::max(hull_.y1, rect.y1)};
  if (hull_.empty()) return;
  const auto rows = static_cast<std::size_t>(hull_.height());
  row_first_.resize(rows);
  columns_ = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    const Span span = bursts_of(hull_.y0 + static_cast<int>(row), hull_.x0, hull_.x1);
    row_first_[row] = span.first;
    columns_ = std::max(columns_, static_cast<std::size_t>(span.end - span.first));
  }
  touched_.assign(rows * columns_, 0);
  for (const IntRect& rect : touched)
    for (int y = rect.y0; y < rect.y1 && !rect.empty(); ++y) {
      const auto row = static_cast<std::size_t>(y - hull_.y0);
      const Span span = bursts_of(y, rect.x0, rect.x1);
      std::fill_n(&touched_[row * columns_ + static_cast<std::size_t>(span.first - row_first_[row])],
                  span.end - span.first, std::uint8_t{1});
    }
}

void TouchedBursts::read(memory::Ledger& ledger, memory::Unit unit, memory::Purpose purpose) const {
  if (hull_.empty()) return;
  // Rows may share a burst: the last of one with the first of the next.
  std::uint64_t next = 0;
  for (std::size_t row = 0; row < row_first_.size(); ++row)
    for (std::size_t column = 0; column < columns_;) {
      if (touched_[row * columns_ + column] == 0) {
        ++column;
        continue;
      }
      std::size_t end = column + 1;
      while (end < columns_ && touched_[row * columns_ + end] != 0) ++end;
      const std::uint64_t first = std::max(row_first_[row] + column, next), last = row_first_[row] + end;
      if (first < last)
        ledger.read_at(unit, purpose, first * burst_bytes_, (last - first) * burst_bytes_, burst_bytes_);
      next = std::max(next, last);
      column = end;
    }
}

}  // namespace tessera::tilecore
