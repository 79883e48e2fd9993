#include "tilecore/resolve/discrepancy.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {
namespace {

bool has(BlockMask mask, int x, int y) { return x >= 0 && x < 4 && y >= 0 && y < 4 && (mask >> (4 * y + x) & 1) != 0; }

}  // namespace

float relative_difference(const Vec4& a, const Vec4& b) {
  const Vec4 difference = glm::abs(a - b), level = glm::max(glm::abs(a), glm::abs(b));
  for (int c = 0; c < 4; ++c)
    if (!(difference[c] <= kLargestDifference)) return 1.0f;
  const float most = std::max(std::max(difference[0], difference[1]), std::max(difference[2], difference[3]));
  return std::min(1.0f, most / (std::max(std::max(level[0], level[1]), level[2]) + kDifferenceFloor));
}

bool stands_out(const Vec4* colors, BlockMask advected, BlockMask rendered, float tolerance) {
  float sum = 0.0f;
  int votes = 0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      if (!has(advected, x, y)) continue;
      Vec4 low(0.0f), high(0.0f);
      int neighbours = 0;
      for (const auto& [dx, dy] : {std::pair{0, -1}, std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, 1}}) {
        if (!has(rendered, x + dx, y + dy)) continue;
        const Vec4& c = colors[4 * (y + dy) + x + dx];
        low = neighbours == 0 ? c : glm::min(low, c);
        high = neighbours == 0 ? c : glm::max(high, c);
        ++neighbours;
      }
      if (neighbours == 0) continue;
      const Vec4& here = colors[4 * y + x];
      sum += relative_difference(here, glm::clamp(here, low, high));
      ++votes;
    }
  return votes > 0 && sum > tolerance * static_cast<float>(votes);
}

}  // namespace tessera::tilecore
