#include "frontend/bounds/coarse_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::frontend {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Column or row of a coordinate, clamped to [low, high].
int block_of(double coordinate, int size, int low, int high) {
  const double block = std::floor(coordinate / size);
  if (!(block > low)) return low;
  return block < high ? static_cast<int>(block) : high;
}

}  // namespace

OcclusionGuess::OcclusionGuess(const CoarseDepth& previous, const scene::Projection& projection,
                               const scene::View& view)
    : depth_(previous) {
  depth_.projection = projection;
  depth_.view = view;
  std::fill(depth_.farthest.begin(), depth_.farthest.end(), 0.0f);
  for (int row = previous.blocks.y0; row < previous.blocks.y1; ++row)
    for (int column = previous.blocks.x0; column < previous.blocks.x1; ++column) splat(previous, column, row);
  // Blocks that nothing reached.
  for (float& far : depth_.farthest)
    if (far == 0.0f) far = kInfinity;
}

void OcclusionGuess::splat(const CoarseDepth& previous, int column, int row) {
  const scene::Projection &from = previous.projection, &to = depth_.projection;
  const float far = previous.at(column, row);
  // What is infinitely far keeps its direction; a depth beyond every scene stands for it.
  const double depth = std::isfinite(far) ? static_cast<double>(far) : 1e12 * std::max(from.near, 1e-6);
  const DMat4 to_raster = to.matrix() * depth_.view.world_to_camera * previous.view.camera_to_world;
  double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300, farthest = 0;
  for (const int corner : {0, 1, 2, 3}) {
    const double x = (column + (corner & 1)) * previous.block_width, y = (row + (corner >> 1)) * previous.block_height;
    const double perspective = from.orthographic ? 1.0 : depth;
    const DVec4 r = to_raster * DVec4((x - from.center_x) / from.scale * perspective,
                                      (from.center_y - y) / from.scale * perspective, -depth, 1);
    if (!(r.z > to.near)) return;  // out of sight now
    x0 = std::min(x0, r.x / r.w), x1 = std::max(x1, r.x / r.w);
    y0 = std::min(y0, r.y / r.w), y1 = std::max(y1, r.y / r.w);
    farthest = std::max(farthest, r.z);
  }
  // A view that did not change maps each block onto itself: what only touches the next by rounding does not reach it.
  constexpr double kInset = 1.0 / 64;
  const IntRect& b = depth_.blocks;
  const int first = block_of(x0 + kInset, depth_.block_width, b.x0 - 1, b.x1),
            last = block_of(x1 - kInset, depth_.block_width, b.x0 - 1, b.x1);
  const int top = block_of(y0 + kInset, depth_.block_height, b.y0 - 1, b.y1),
            bottom = block_of(y1 - kInset, depth_.block_height, b.y0 - 1, b.y1);
  const float value = std::isfinite(far) ? static_cast<float>(farthest) : kInfinity;
  for (int y = std::max(top, b.y0); y <= std::min(bottom, b.y1 - 1); ++y)
    for (int x = std::max(first, b.x0); x <= std::min(last, b.x1 - 1); ++x) {
      float& slot = depth_.farthest[static_cast<std::size_t>((y - b.y0) * b.width() + (x - b.x0))];
      slot = std::max(slot, value);
    }
}

bool OcclusionGuess::hidden_by(const CoarseDepth& depth, const ScreenBounds& bounds) {
  const IntRect& b = depth.blocks;
  // One block more than the bounds' own where they end on a block's edge: bounds are closed.
  const int x0 = std::max(block_of(static_cast<double>(bounds.x0) - 1.0 / 64, depth.block_width, b.x0 - 1, b.x1), b.x0);
  const int x1 = std::min(block_of(static_cast<double>(bounds.x1), depth.block_width, b.x0 - 1, b.x1), b.x1 - 1);
  const int y0 =
      std::max(block_of(static_cast<double>(bounds.y0) - 1.0 / 64, depth.block_height, b.y0 - 1, b.y1), b.y0);
  const int y1 = std::min(block_of(static_cast<double>(bounds.y1), depth.block_height, b.y0 - 1, b.y1), b.y1 - 1);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x)
      if (!(bounds.near_z > depth.at(x, y))) return false;
  return true;
}

}  // namespace tessera::frontend
