#include "tilecore/resolve/edge_detector.h"

#include <algorithm>
#include <cmath>

#include "tilecore/resolve/channels.h"

namespace tessera::tilecore {

namespace {

// A whole block, row by row at once.
bool detect_edge_4x4(const EdgeSettings& settings, const float* depth, std::size_t stride, bool inverse) {
  Channels row[4], nothing{};  // +0 where depth is finite, else NaN
  for (std::size_t y = 0; y < 4; ++y) {
    row[y] = load(depth + y * stride);
    nothing += row[y] - row[y];
  }
  if (!is_zero(nothing)) {
    int seen = 0;
    for (const Channels& r : row)
      for (int x = 0; x < 4; ++x) seen += std::isfinite(r[x]) ? 1 : 0;
    return seen > 0;
  }
  if (inverse)
    for (Channels& r : row) r = 1.0f / r;
  const Channels along_y[2] = {row[0] - 2.0f * row[1] + row[2], row[1] - 2.0f * row[2] + row[3]};
  for (int y = 0; y < 4; ++y) {
    const Channels &r = row[y], left = {r[0], r[0], r[1], r[1]}, middle = {r[1], r[1], r[2], r[2]},
                   right = {r[2], r[2], r[3], r[3]};
    const Channels laplacian = (left - 2.0f * middle + right) + along_y[y / 2];
    if (!none(magnitude(laplacian) > settings.threshold * magnitude(r))) return true;
  }
  return false;
}

}  // namespace

bool detect_edge(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height) {
  const bool inverse = settings.measure == EdgeMeasure::kInverseDepth && !settings.orthographic;
  if (width == 4 && height == 4) return detect_edge_4x4(settings, depth, stride, inverse);
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
