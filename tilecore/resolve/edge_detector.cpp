#include "tilecore/resolve/edge_detector.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {

bool detect_edge_by_pixel(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height) {
  const bool inverse = settings.measure == EdgeMeasure::kInverseDepth && !settings.orthographic;
  float value[4][4] = {};
  int seen = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float z = depth[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)];
      seen += std::isfinite(z) ? 1 : 0;
      value[y][x] = inverse ? 1.0f / z : z;
    }
  if (seen == 0) return false;
  if (seen < width * height) return true;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int cx = std::clamp(x, 1, std::max(1, width - 2)), cy = std::clamp(y, 1, std::max(1, height - 2));
      float laplacian = 0.0f;
      if (width >= 3) laplacian += value[y][cx - 1] - 2.0f * value[y][cx] + value[y][cx + 1];
      if (height >= 3) laplacian += value[cy - 1][x] - 2.0f * value[cy][x] + value[cy + 1][x];
      if (std::abs(laplacian) > settings.threshold * std::abs(value[y][x])) return true;
    }
  return false;
}

}  // namespace tessera::tilecore
