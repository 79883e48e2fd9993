#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "tilecore/depth_blocks.h"
#include "tilecore/pixel_ids.h"
#include "tilecore/triangle_table.h"

namespace tessera::tilecore {

// How a pixel is shaded (DeferredShader::shade()).
enum PixelRate : std::uint8_t {
  kSkipped = 0,      // its samples have no colour
  kTogether = 1,     // all samples may share invocations
  kHalvesApart = 2,  // samples in the left half do not share with samples in the right
};

// Data that the tile memory keeps for a sample or a blended layer. Its time and lens point follow from its number, and
// its rest place, if needed, from the corners of its triangle (TriangleTable).
struct SampleLayout {
  int weight_bits = 16;     // of each of two weights (tilecore.weight_bits)
  bool parameters = false;  // surfaces of procedures: patch and full parameters, and with `rest` the rest place
  bool rest = false;
  bool depth_only = false;
  std::uint64_t gbuffer_bytes = 0;  // of a sample, when the tile is shaded
  // Depth, triangle and weights.
  std::uint64_t sample_bytes() const {
    if (depth_only) return 4;
    if (parameters) return rest ? 28 : 20;
    return 4 + 4 + static_cast<std::uint64_t>(2 * weight_bits + 7) / 8;
  }
  // The room that the sample takes in all: the G-buffer lies where the record was, behind the depth.
  std::uint64_t room_bytes() const {
    constexpr std::uint64_t kDepthBytes = 4;
    return std::max(sample_bytes(), depth_only || gbuffer_bytes == 0 ? 0 : kDepthBytes + gbuffer_bytes);
  }
  // The same, and the sample's number.
  std::uint64_t layer_bytes() const { return sample_bytes() + 4; }
};

// Surfaces that the samples of a tile see. It survives partial renders, which store it to memory and load it again.
struct TileState {
  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFFu;
  // Most layers that the emulator keeps for one tile: 256 MiB.
  static constexpr std::size_t kMaxLayers = std::size_t{1} << 23;

  // Nearest opaque surface per sample, natural order.
  std::vector<float> z, b1, b2, rest_x, rest_y;
  std::vector<std::uint32_t> patch, triangle;
  std::vector<std::uint8_t> positive;  // sign of the triangle's area in raster space; a bit of its number in memory

  // Blended surfaces in front of it, in any order until the tile is finished; a later opaque surface may hide some of
  // them.
  struct Layer {
    std::uint32_t sample, patch, triangle;
    float z, b1, b2, rest_x, rest_y;
  };
  std::vector<Layer> layers;
  std::size_t max_layers = kMaxLayers;

  std::size_t uncovered = 0;  // samples that see no opaque surface yet

  bool started = false;
  bool keeps_rest = false;    // rest_x and rest_y are set
  bool depths_alone = false;  // of a prepass; set before start()
  SampleLayout layout;
  TriangleTable triangles;  // of sub-patches that samples or layers see
  SeenSubPatches seen;      // the same by name, with TileJob::pixel_ids
  // Starts a tile: `spp` samples for each pixel of a tile of that width, row by row.
  void start(std::size_t samples, int width, int spp);

  // An opaque surface became the nearest at sample s: writes its depth.
  void take_depth(std::size_t s, float depth) {
    const bool first = patch[s] == kNoPatch;
    if (first) --uncovered;
    z[s] = depth;
    depth_blocks_.touch(s, first);
  }

  // Keeps a layer unless an opaque surface hides it; a layer at the depth of the surface stays visible. Returns whether
  // it was kept. Throws LimitError when more than max_layers are in front of opaque surfaces.
  bool add_layer(const Layer& layer) {
    if (layer.z > z[layer.sample]) return false;
    if (layers.size() >= next_drop_) make_room();
    layers.push_back(layer);
    return true;
  }
  // Drops the layers that an opaque surface hides.
  void drop_hidden_layers();

  // The tile's far plane: infinity while a sample sees no surface.
  float farthest() { return uncovered > 0 ? kNothing : depth_blocks_.farthest(z); }
  // The same for the blocks of 8x8 pixels that hold `pixels`, counted from the tile's corner.
  float farthest(const IntRect& pixels) { return depth_blocks_.farthest(z, pixels); }
  // Number of 8x8-pixel blocks scanned for farthest depths since the last call.
  std::uint64_t take_depth_updates() { return depth_blocks_.take_updates() + known_blocks_.take_updates(); }

  // Depths that a pass before left of the samples, infinity where it saw nothing: what begins behind them is hidden.
  // `spp` samples for each pixel of a tile of that width.
  void hide_behind(std::vector<float> depths, int width, int spp);
  // Whether that hides all that is no nearer than `nearest` in the blocks of 8x8 pixels that some pixels are in.
  bool known_to_hide(float nearest, const IntRect& pixels) {
    return !known_depths_.empty() && nearest > known_blocks_.farthest(known_depths_, pixels);
  }

  // Bytes of the state of a machine that keeps at most `capacity` layers of a sample. extra_bytes(): without samples.
  std::uint64_t bytes(std::size_t capacity) const;
  std::uint64_t extra_bytes(std::size_t capacity) const;

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();

  void make_room();
  DepthBlocks depth_blocks_, known_blocks_;
  std::vector<float> known_depths_;  // empty: no pass was before
  std::size_t next_drop_ = 0;        // number of layers at which to search for hidden ones
};

}  // namespace tessera::tilecore
