#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "scene/shadow_settings.h"
#include "shaders_cpp/shadow_map.h"
#include "shaders_cpp/texture.h"

namespace tessera::tilecore {

// The maps of a light, layer by layer: depth-only passes store them, and shadow lookups read them. Tiles of a layer
// write disjoint parts. A tile without casters is not written: a flag of one bit marks it.
//
// Invariants (cited by the tests):
//   MAP1  A depth that is read differs from the one that was stored by at most half a step of the format.
//   MAP2  A tile that is not written reads as empty.
class DepthMaps {
 public:
  // `side`: texels along a layer; `tile_width`, `tile_height`: of the tiles that write it.
  DepthMaps(int side, int layers, scene::DepthFormat format, int tile_width, int tile_height);

  int side() const { return side_; }
  int layers() const { return layers_; }
  shaders::TexelBlocks blocks() const { return {1, scene::depth_bytes(format_)}; }
  std::uint64_t texel_bytes() const { return static_cast<std::uint64_t>(scene::depth_bytes(format_)); }
  // The size of all layers in memory, without flags.
  std::uint64_t bytes() const {
    return texel_bytes() * static_cast<std::uint64_t>(side_) * static_cast<std::uint64_t>(side_) *
           static_cast<std::uint64_t>(layers_);
  }
  std::uint64_t flag_bytes() const { return (cleared_.size() + 7) / 8; }
  // The interface of images, for texture units.
  int level_count() const { return layers_; }
  int width(int = 0) const { return side_; }
  int height(int = 0) const { return side_; }

  // Sets the depth range of a layer, for the tiles that are stored from now on.
  void begin(int layer, double near, double far);
  // The step between depths of a layer.
  double step(int layer) const { return steps_[static_cast<std::size_t>(layer)].step; }
  // Stores the depths of a tile, row by row; infinity means no surface. Returns false if the tile is empty, so that
  // only its flag is stored.
  bool store(int layer, const IntRect& pixels, std::span<const float> depths);

  const float* layer_texels(int layer) const { return texels_.data() + first_texel(layer); }
  float texel(int layer, int x, int y) const { return texels_[first_texel(layer) + offset(x, y)]; }
  // By layer and tile, row by row: 1 if only the flag is stored.
  const std::vector<std::uint8_t>& cleared() const { return cleared_; }
  int tiles_across() const { return tiles_across_; }
  int tiles_down() const { return tiles_down_; }
  int tile_width() const { return tile_width_; }
  int tile_height() const { return tile_height_; }

 private:
  struct Steps {
    double near = 0, step = 0;  // 0: single precision
  };
  std::size_t offset(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(x);
  }
  std::size_t first_texel(int layer) const {
    return static_cast<std::size_t>(layer) * static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  }

  int side_, layers_;
  scene::DepthFormat format_;
  int tile_width_, tile_height_, tiles_across_, tiles_down_;
  std::vector<float> texels_;
  std::vector<Steps> steps_;
  std::vector<std::uint8_t> cleared_;
};

}  // namespace tessera::tilecore
