#include "tilecore/shading/depth_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::tilecore {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

int tiles(int texels, int side) { return (texels + side - 1) / side; }

}  // namespace

DepthMaps::DepthMaps(int side, int layers, scene::DepthFormat format, int tile_width, int tile_height)
    : side_(side),
      layers_(layers),
      format_(format),
      tile_width_(tile_width),
      tile_height_(tile_height),
      tiles_across_(tiles(side, tile_width)),
      tiles_down_(tiles(side, tile_height)),
      texels_(first_texel(layers), kNothing),
      steps_(static_cast<std::size_t>(layers)),
      cleared_(static_cast<std::size_t>(layers * tiles_across_ * tiles_down_), 1) {}

void DepthMaps::begin(int layer, double near, double far) {
  steps_[static_cast<std::size_t>(layer)] = {near, scene::depth_step(format_, far - near)};
}

bool DepthMaps::store(int layer, const IntRect& pixels, std::span<const float> depths) {
  const auto tile = static_cast<std::size_t>((layer * tiles_down_ + pixels.y0 / tile_height_) * tiles_across_ +
                                             pixels.x0 / tile_width_);
  cleared_[tile] = std::ranges::none_of(depths, [](float z) { return z < kNothing; }) ? 1 : 0;
  const auto [near, step] = steps_[static_cast<std::size_t>(layer)];
  const auto width = static_cast<std::size_t>(pixels.width());
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const float* from = depths.data() + static_cast<std::size_t>(y - pixels.y0) * width;
    float* to = &texels_[first_texel(layer) + offset(pixels.x0, y)];
    for (std::size_t k = 0; k < width; ++k) {
      const double z = static_cast<double>(from[k]);
      to[k] = step == 0 || !(from[k] < kNothing) ? from[k]
                                                 : static_cast<float>(near + std::round((z - near) / step) * step);
    }
  }
  return cleared_[tile] == 0;
}

}  // namespace tessera::tilecore
