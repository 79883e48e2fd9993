#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace tessera::tilecore {

// A shaded blended surface as one sample sees it.
struct BlendedLayer {
  Vec3 color{0.0f};  // linear, multiplied by alpha
  float alpha = 0;
  float z = 0;
  std::uint32_t patch = 0, triangle = 0;
};

// Order in which layers lie behind each other; of equal depths the higher patch, then the higher triangle is on top.
bool nearer(const BlendedLayer& a, const BlendedLayer& b);

// Multi-layer alpha blending (Salvi and Vaidyanathan 2014) of a sample that has room for `capacity` layers: they come
// in order of submission (patch, then triangle), are kept in order of depth, and whenever there is one too many the two
// farthest become one, the nearer over the farther, which keeps the place of the nearer. Nothing is dropped; what is
// lost is the order of what comes between two merged layers later.
//
// Tiles find layers in the order of their queues, which differs from one tiling to the next; the order of submission
// does not, and is the order that GPUs with ordered interlocks (VK_EXT_fragment_shader_interlock) give to each sample.
// So the result depends on the set of layers alone. It follows that layers are merged when the tile is finished and not
// before: an opaque surface may still arrive anywhere among them and hides exactly those behind it, so a state from
// which every such outcome can be told is as large as the layers themselves. TileState bounds that memory, by an error.
//
// `far_to_near` holds the layers in that order, before and after. merge() returns how many layers had no room.
class LayerMerger {
 public:
  static constexpr std::size_t kMaxCapacity = 64;
  std::size_t merge(std::vector<BlendedLayer>& far_to_near, std::size_t capacity);

 private:
  std::array<BlendedLayer, kMaxCapacity + 1> kept_;  // near to far
};

}  // namespace tessera::tilecore
