#include "tilecore/resolve/checkerboard.h"

#include <cmath>

namespace tessera::tilecore {
namespace {

bool all_finite(const Vec4& c) {
  return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z) && std::isfinite(c.w);
}

// The up to four neighbours that may be used.
struct Cross {
  std::array<Vec4, 4> color;
  std::size_t count = 0;

  // Differences from the first: a flat colour is exact.
  Vec4 mean() const {
    Vec4 sum(0.0f);
    for (std::size_t i = 1; i < count; ++i) sum += color[i] - color[0];
    return color[0] + sum / static_cast<float>(count);
  }
};

bool is_usable(const BlockWindow& window, BlockMask missing, int x, int y) {
  const int bx = x - kWindowMargin, by = y - kWindowMargin;
  if (bx >= 0 && bx < 4 && by >= 0 && by < 4 && (missing >> (4 * by + bx) & 1)) return false;
  return window.usable[static_cast<std::size_t>(y)] >> x & 1;
}

Cross gather(const BlockWindow& window, BlockMask missing, int x, int y, CheckerboardWork& work) {
  constexpr int kSteps[4][2] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
  Cross cross;
  for (const auto& step : kSteps) {
    const int nx = x + step[0], ny = y + step[1];
    if (!is_usable(window, missing, nx, ny)) continue;
    ++work.taps;
    const Vec4& color = window.first_pixel[ny * window.row_stride + nx];
    if (all_finite(color))
      cross.color[cross.count++] = color;
    else
      ++work.non_finite_pixels;
  }
  return cross;
}

}  // namespace

BlockMask reconstruct_checkerboard(const BlockWindow& window, BlockMask missing, Vec4* out16, CheckerboardWork& work) {
  BlockMask unfilled = 0;
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const Cross cross = gather(window, missing, p % 4 + kWindowMargin, p / 4 + kWindowMargin, work);
    if (cross.count == 0) {
      unfilled = static_cast<BlockMask>(unfilled | 1u << p);
      continue;
    }
    ++work.pixels;
    out16[p] = cross.mean();
  }
  return unfilled;
}

}  // namespace tessera::tilecore
