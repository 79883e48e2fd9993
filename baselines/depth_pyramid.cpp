#include "baselines/depth_pyramid.h"

#include <algorithm>
#include <cmath>

namespace tessera::baselines {
namespace {

constexpr std::uint64_t kDepthBytes = 2;
constexpr float kRoundedUp = 1 + 0x1p-10f;  // one in the last of 11 bits, at most

int halved(int count) { return (count + 1) / 2; }

}  // namespace

DepthPyramid::DepthPyramid(const IntRect& region) : region_(region) {
  int columns = std::max((region.width() + kBlockSide - 1) / kBlockSide, 1),
      rows = std::max((region.height() + kBlockSide - 1) / kBlockSide, 1);
  for (bool last = false; !last; columns = halved(columns), rows = halved(rows)) {
    levels_.push_back({columns, rows, {}});
    last = columns == 1 && rows == 1;
  }
  const auto blocks = static_cast<std::size_t>(levels_[0].columns) * static_cast<std::size_t>(levels_[0].rows);
  levels_[0].farthest.assign(blocks, 0.0f);
}

void DepthPyramid::add(const IntRect& pixels, std::span<const float> farthest) {
  const int columns = (pixels.width() + kBlockSide - 1) / kBlockSide;
  for (std::size_t k = 0; k < farthest.size(); ++k) {
    const int column = static_cast<int>(k) % columns, row = static_cast<int>(k) / columns;
    const int x0 = pixels.x0 + column * kBlockSide - region_.x0, y0 = pixels.y0 + row * kBlockSide - region_.y0;
    const int x1 = std::min(x0 + kBlockSide, pixels.x1 - region_.x0),
              y1 = std::min(y0 + kBlockSide, pixels.y1 - region_.y0);
    // A block of a tile lies in several blocks of the pyramid if tiles do not begin with one.
    for (int y = y0 / kBlockSide; y <= (y1 - 1) / kBlockSide; ++y)
      for (int x = x0 / kBlockSide; x <= (x1 - 1) / kBlockSide; ++x) {
        float& depth = levels_[0].farthest[static_cast<std::size_t>(y * levels_[0].columns + x)];
        depth = std::max(depth, farthest[k] * kRoundedUp);
      }
  }
}

void DepthPyramid::finish() {
  for (std::size_t n = 1; n < levels_.size(); ++n) {
    const Level& finer = levels_[n - 1];
    Level& level = levels_[n];
    level.farthest.clear();
    for (int row = 0; row < level.rows; ++row)
      for (int column = 0; column < level.columns; ++column) {
        float farthest = 0;
        for (int y = 2 * row; y < std::min(2 * row + 2, finer.rows); ++y)
          for (int x = 2 * column; x < std::min(2 * column + 2, finer.columns); ++x)
            farthest = std::max(farthest, finer.farthest[static_cast<std::size_t>(y * finer.columns + x)]);
        level.farthest.push_back(farthest);
      }
  }
}

bool DepthPyramid::hides(const frontend::ScreenBounds& rectangle) const {
  const auto texel = [](float pixel, int origin, int count) {
    return static_cast<int>(
        std::clamp(std::floor((pixel - static_cast<float>(origin)) / kBlockSide), 0.0f, static_cast<float>(count - 1)));
  };
  int x0 = texel(rectangle.x0, region_.x0, levels_[0].columns),
      x1 = texel(rectangle.x1, region_.x0, levels_[0].columns), y0 = texel(rectangle.y0, region_.y0, levels_[0].rows),
      y1 = texel(rectangle.y1, region_.y0, levels_[0].rows);
  std::size_t n = 0;
  for (; x1 - x0 > 1 || y1 - y0 > 1; ++n) x0 /= 2, x1 /= 2, y0 /= 2, y1 /= 2;
  const Level& level = levels_[n];
  float farthest = 0;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x)
      farthest = std::max(farthest, level.farthest[static_cast<std::size_t>(y * level.columns + x)]);
  return rectangle.near_z > farthest;
}

std::uint64_t DepthPyramid::bytes() const {
  std::uint64_t texels = 0;
  for (const Level& level : levels_) texels += level.farthest.size();
  return texels * kDepthBytes;
}

}  // namespace tessera::baselines
