#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace tessera::tilecore {

// A shaded blended surface at one sample.
struct BlendedLayer {
  Vec3 color{0.0f};  // linear, multiplied by alpha
  float alpha = 0;
  float z = 0;
  std::uint32_t patch = 0, triangle = 0;
};

// Depth order of layers; at equal depths the higher patch, then the higher triangle is on top.
bool nearer(const BlendedLayer& a, const BlendedLayer& b);

// Multi-layer alpha blending (Salvi and Vaidyanathan 2014) of a sample that has room for `capacity` layers: they come
// in order of submission (patch, then triangle) and are kept in order of depth. Whenever there is one too many the two
// farthest become one, the nearer over the farther, at the depth of the nearer. No layer is dropped; but a layer that
// later comes between two merged ones loses its order.
//
// Tiles find layers in the order of their lists, which depends on the tiling; the order of submission does not, and is
// the order that GPUs with ordered interlocks (VK_EXT_fragment_shader_interlock) give to each sample. So the result
// depends on the set of layers alone. Layers are therefore merged only when the tile is finished: an opaque surface may
// still arrive anywhere among them and hides exactly the layers behind it, so a state that keeps every such outcome is
// as large as the layers themselves. TileState bounds that memory, with an error.
//
// `far_to_near` holds the layers in that order, before and after. merge() returns the number of layers without room.
class LayerMerger {
 public:
  static constexpr std::size_t kMaxCapacity = 64;
  std::size_t merge(std::vector<BlendedLayer>& far_to_near, std::size_t capacity);

 private:
  std::array<BlendedLayer, kMaxCapacity + 1> kept_;  // near to far
};

}  // namespace tessera::tilecore
