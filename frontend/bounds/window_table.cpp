#include "frontend/bounds/window_table.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/parallel.h"

namespace tessera::frontend {
namespace {

int log2_below(int n) { return static_cast<int>(std::bit_width(static_cast<unsigned>(n))) - 1; }
// Windows along a side of `size` texels.
int windows(int size, int log2_side, int log2_apart) {
  const int rest = size - (1 << log2_side);
  return rest <= 0 ? 1 : ((rest + (1 << log2_apart) - 1) >> log2_apart) + 1;
}

}  // namespace

WindowTable::WindowTable(int width, int height, const std::function<ValueRange(int, int)>& value)
    : width_(width), height_(height) {
  constexpr int kLog2PerSide = 2;
  static_assert(1 << kLog2PerSide == kWindowsPerSide);
  const auto row_length = static_cast<std::size_t>(width);
  std::vector<ValueRange> texels(row_length * static_cast<std::size_t>(height));
  parallel_for(static_cast<std::size_t>(height), [&](std::size_t y) {
    for (std::size_t x = 0; x < row_length; ++x)
      texels[y * row_length + x] = value(static_cast<int>(x), static_cast<int>(y));
  });
  // Each window joins four of half its side, as far as the grid goes.
  const auto join = [&](const Step& step, const std::vector<ValueRange>& finer, int finer_side, int finer_log2_apart,
                        int finer_columns, int finer_rows) {
    std::vector<ValueRange> entries;
    entries.reserve(static_cast<std::size_t>(step.columns) * static_cast<std::size_t>(step.rows));
    const auto place_of = [&](int texel, int count) { return std::min(texel >> finer_log2_apart, count - 1); };
    for (int row = 0; row < step.rows; ++row)
      for (int column = 0; column < step.columns; ++column) {
        const int x = column << step.log2_apart, y = row << step.log2_apart;
        const int right = x + finer_side < width ? x + finer_side : x,
                  below = y + finer_side < height ? y + finer_side : y;
        const auto at = [&](int from_x, int from_y) {
          return finer[static_cast<std::size_t>(place_of(from_y, finer_rows)) *
                           static_cast<std::size_t>(finer_columns) +
                       static_cast<std::size_t>(place_of(from_x, finer_columns))];
        };
        entries.push_back(at(x, y).hull(at(right, y)).hull(at(x, below)).hull(at(right, below)));
      }
    return entries;
  };
  for (int k = 1; k == 1 || 1 << (k - 1) < std::max(width, height); ++k) {
    const int apart = std::max(0, k - kLog2PerSide);
    Step step{k, apart, windows(width, k, apart), windows(height, k, apart), 0, {}};
    if (k == 1) {
      step.entries = join(step, texels, 1, 0, width, height);
    } else {
      const Step& finer = steps_.back();
      step.entries = join(step, finer.entries, 1 << finer.log2_side, finer.log2_apart, finer.columns, finer.rows);
    }
    steps_.push_back(std::move(step));
  }
}

std::size_t WindowTable::entry_count() const {
  std::size_t count = 0;
  for (const Step& step : steps_) count += step.entries.size();
  return count;
}

std::uint64_t WindowTable::place(std::uint64_t address) {
  for (Step& step : steps_) {
    step.address = address;
    address += step.entries.size() * kEntryBytes;
  }
  return address;
}

WindowTable::Span WindowTable::span(const Step& step, int count, int low, int high) {
  const int apart = 1 << step.log2_apart, side = 1 << step.log2_side;
  const int first = std::min(low >> step.log2_apart, count - 1),
            last = std::max(high + 1 - side + apart - 1, 0) >> step.log2_apart;
  return {first, std::max(first, last)};
}

ValueRange WindowTable::joined(const Step& step, int column0, int row0, int column1, int row1,
                               HeightTableCache* fetches) {
  const int stride = (1 << step.log2_side) >> step.log2_apart;
  if (fetches != nullptr)
    for (int row = row0;; row = std::min(row + stride, row1)) {
      for (int column = column0;; column = std::min(column + stride, column1)) {
        fetches->fetch(step.address + (static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(step.columns) +
                                       static_cast<std::uint64_t>(column)) *
                                          kEntryBytes);
        if (column == column1) break;
      }
      if (row == row1) break;
    }
  // Joins the first and last windows and one at every stride between them. Most queries join four windows, some of them
  // equal, and no load depends on another.
  const auto at = [&](int column, int row) {
    return step.entries[static_cast<std::size_t>(row) * static_cast<std::size_t>(step.columns) +
                        static_cast<std::size_t>(column)];
  };
  ValueRange range = at(column0, row0).hull(at(column1, row0)).hull(at(column0, row1).hull(at(column1, row1)));
  for (int column = column0 + stride; column < column1; column += stride)
    range = range.hull(at(column, row0).hull(at(column, row1)));
  for (int row = row0 + stride; row < row1; row += stride)
    for (int column = column0;; column = std::min(column + stride, column1)) {
      range = range.hull(at(column, row));
      if (column == column1) break;
    }
  return range;
}

ValueRange WindowTable::over(int x0, int y0, int x1, int y1, HeightTableCache* fetches) const {
  const int width = x1 - x0 + 1, height = y1 - y0 + 1;
  const int k = std::max({log2_below(std::min(width, height)), log2_below((std::max(width, height) - 1) | 1) - 1, 1});
  const Step& step = steps_[static_cast<std::size_t>(std::min(k, static_cast<int>(steps_.size())) - 1)];
  const Span columns = span(step, step.columns, x0, x1), rows = span(step, step.rows, y0, y1);
  return joined(step, columns.first, rows.first, columns.last, rows.last, fetches);
}

}  // namespace tessera::frontend
