#pragma once

#include <algorithm>
#include <cstddef>

namespace tessera {

// Half-open rectangle of integers: x0 <= x < x1, y0 <= y < y1. Empty when x0 >= x1 or y0 >= y1.
struct IntRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return std::max(0, x1 - x0); }
  int height() const { return std::max(0, y1 - y0); }
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  // Which one of its places (x, y) is, row by row from 0 on.
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width()) + static_cast<std::size_t>(x - x0);
  }
  IntRect intersect(const IntRect& o) const {
    return {std::max(x0, o.x0), std::max(y0, o.y0), std::min(x1, o.x1), std::min(y1, o.y1)};
  }
  bool operator==(const IntRect&) const = default;
};

}  // namespace tessera
