#include "tilecore/resolve/crease_detector.h"

#include <array>

#include "base/vec.h"

namespace tessera::tilecore {

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
