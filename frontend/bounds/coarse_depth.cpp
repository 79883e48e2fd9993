#include "frontend/bounds/coarse_depth.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace tessera::frontend {
namespace {

constexpr int kBitsLeftOut = 15;

// Column or row of a coordinate, clamped to [low, high].
int block_of(double coordinate, int size, int low, int high) {
  const double block = std::floor(coordinate / size);
  if (!(block > low)) return low;
  return block < high ? static_cast<int>(block) : high;
}

// Blocks of `all` that [x0, x1] x [y0, y1] touches.
IntRect touched(double x0, double y0, double x1, double y1, int side, const IntRect& all) {
  return {std::max(block_of(x0, side, all.x0 - 1, all.x1), all.x0),
          std::max(block_of(y0, side, all.y0 - 1, all.y1), all.y0),
          std::min(block_of(x1, side, all.x0 - 1, all.x1) + 1, all.x1),
          std::min(block_of(y1, side, all.y0 - 1, all.y1) + 1, all.y1)};
}

void splat(const CoarseDepth& previous, const DMat4& to_raster, int column, int row, CoarseDepth& out) {
  const scene::Projection& from = previous.projection;
  const DepthCode code = previous.at(column, row);
  // An empty block is infinitely far and keeps its direction; a depth beyond every scene stands for it.
  const bool nothing = code == kNothingSeen;
  const double depth = nothing ? 1e12 * std::max(from.near, 1e-6) : static_cast<double>(depth_of(code));
  double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300, farthest = 0;
  for (const int corner : {0, 1, 2, 3}) {
    const double x = (column + (corner & 1)) * previous.block_pixels, y = (row + (corner >> 1)) * previous.block_pixels;
    const double perspective = from.orthographic ? 1.0 : depth;
    const DVec4 r = to_raster * DVec4((x - from.center_x) / from.scale * perspective,
                                      (from.center_y - y) / from.scale * perspective, -depth, 1);
    if (!(r.z > out.projection.near)) return;  // out of sight now
    x0 = std::min(x0, r.x / r.w), x1 = std::max(x1, r.x / r.w);
    y0 = std::min(y0, r.y / r.w), y1 = std::max(y1, r.y / r.w);
    farthest = std::max(farthest, r.z);
  }
  const IntRect b =
      touched(x0 - kSplatPixels, y0 - kSplatPixels, x1 + kSplatPixels, y1 + kSplatPixels, out.block_pixels, out.blocks);
  const DepthCode value = nothing ? kNothingSeen : code_not_nearer(static_cast<float>(farthest * (1 - 1e-6)));
  for (int y = b.y0; y < b.y1; ++y)
    for (int x = b.x0; x < b.x1; ++x) out.farthest[out.blocks.index(x, y)] = std::max(out.at(x, y), value);
}

}  // namespace

DepthCode code_not_nearer(float depth) {
  if (!(depth <= std::numeric_limits<float>::max())) return kNothingSeen;
  if (!(depth > 0)) return 0;
  return static_cast<DepthCode>((std::bit_cast<std::uint32_t>(depth) + ((1u << kBitsLeftOut) - 1)) >> kBitsLeftOut);
}

DepthCode code_not_farther(float depth) {
  return depth > 0 ? static_cast<DepthCode>(std::bit_cast<std::uint32_t>(depth) >> kBitsLeftOut) : DepthCode{0};
}

float depth_of(DepthCode code) { return std::bit_cast<float>(std::uint32_t{code} << kBitsLeftOut); }

IntRect CoarseDepth::blocks_of(const IntRect& region, int block_pixels) {
  return {region.x0 / block_pixels, region.y0 / block_pixels, (region.x1 + block_pixels - 1) / block_pixels,
          (region.y1 + block_pixels - 1) / block_pixels};
}

BlockFootprint CoarseDepth::footprint(const ScreenBounds& bounds) const {
  // One block more where the bounds begin on a block's edge: they are closed.
  constexpr double kEdge = 1.0 / 64;
  const IntRect b = touched(static_cast<double>(bounds.x0) - kEdge, static_cast<double>(bounds.y0) - kEdge,
                            static_cast<double>(bounds.x1), static_cast<double>(bounds.y1), block_pixels, blocks);
  if (b.empty()) return {};
  return {b, code_not_farther(bounds.near_z)};
}

bool CoarseDepth::hides(const BlockFootprint& footprint, std::uint64_t& blocks_tested) const {
  const IntRect& b = footprint.blocks;
  if (b.empty()) return false;
  for (int y = b.y0; y < b.y1; ++y)
    for (int x = b.x0; x < b.x1; ++x) {
      ++blocks_tested;
      if (footprint.nearest <= at(x, y)) return false;
    }
  return true;
}

CoarseDepth reproject(const CoarseDepth& previous, const scene::Projection& projection, const scene::View& view) {
  CoarseDepth out{previous.block_pixels, previous.blocks, std::vector<DepthCode>(previous.farthest.size(), 0),
                  projection, view};
  const DMat4 to_raster = projection.matrix() * view.world_to_camera * previous.view.camera_to_world;
  for (int row = previous.blocks.y0; row < previous.blocks.y1; ++row)
    for (int column = previous.blocks.x0; column < previous.blocks.x1; ++column)
      splat(previous, to_raster, column, row, out);
  for (DepthCode& far : out.farthest)
    if (far == 0) far = kNothingSeen;  // nothing landed there
  return out;
}

}  // namespace tessera::frontend
