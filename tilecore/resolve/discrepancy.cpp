#include "tilecore/resolve/discrepancy.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {
float relative_difference(const Vec4& a, const Vec4& b) {
  const Vec4 difference = glm::abs(a - b), level = glm::max(glm::abs(a), glm::abs(b));
  for (int c = 0; c < 4; ++c)
    if (!(difference[c] <= kLargestDifference)) return 1.0f;
  const float most = std::max(std::max(difference[0], difference[1]), std::max(difference[2], difference[3]));
  return std::min(1.0f, most / (std::max(std::max(level[0], level[1]), level[2]) + kDifferenceFloor));
}

}  // namespace tessera::tilecore
