#include "tilecore/resolve/edge_detector.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vec.h"

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

bool CreaseDetector::detect(const float* depth, std::size_t stride, int x, int y) const {
  std::array<Vec3, 4> normals;
  for (std::size_t q = 0; q < 4; ++q) {
    const std::size_t i = q % 2 * 2, j = q / 2 * 2;
    const float *here = depth + j * stride + i, *below = here + stride;
    const auto value = [&](const float* z) { return orthographic_ ? *z : 1.0f / *z; };
    const float a = value(here), b = value(here + 1), c = value(below), d = value(below + 1);
    const float by_x = 0.5f * ((b - a) + (d - c)), by_y = 0.5f * ((c - a) + (d - b)),
                mean = 0.25f * ((a + b) + (c + d));
    // The middle of the square lies on the corner that its four pixels share.
    const float px = static_cast<float>(x + static_cast<int>(i) + 1) - center_x_,
                py = static_cast<float>(y + static_cast<int>(j) + 1) - center_y_;
    normals[q] = orthographic_ ? Vec3(by_x * scale_, by_y * scale_, -1.0f)
                               : Vec3(by_x * scale_, by_y * scale_, mean - by_x * px - by_y * py);
  }
  for (std::size_t q = 0; q < 4; ++q)
    for (std::size_t r = q + 1; r < 4; ++r) {
      const float both = glm::dot(normals[q], normals[q]) * glm::dot(normals[r], normals[r]);
      if (glm::dot(normals[q], normals[r]) < cosine_ * std::sqrt(both)) return true;
    }
  return false;
}

}  // namespace tessera::tilecore
