#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::tilecore {

// What the samples of a tile see. Survives partial renders, when it is stored to memory and loaded again.
struct TileState {
  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFFu;
  static constexpr std::uint64_t kBytesPerSample = 20;                  // z, patch, triangle, two weights
  static constexpr std::uint64_t kBytesPerLayer = kBytesPerSample + 4;  // the same and the sample's number
  // Most layers that the emulator keeps of one tile: 256 MiB.
  static constexpr std::size_t kMaxLayers = std::size_t{1} << 23;

  // Nearest opaque surface per sample, natural order.
  std::vector<float> z, b1, b2, rest_x, rest_y;
  std::vector<std::uint32_t> patch, triangle;
  std::vector<std::uint8_t> positive;  // sign of the triangle's area in raster space; a bit of its number in memory

  // Blended surfaces in front of it, in any order until the tile is finished; some may be behind what is opaque by now.
  struct Layer {
    std::uint32_t sample, patch, triangle;
    float z, b1, b2, rest_x, rest_y;
  };
  std::vector<Layer> layers;
  std::size_t max_layers = kMaxLayers;

  std::size_t uncovered = 0;  // samples that see nothing opaque yet

  bool started = false;
  void start(std::size_t samples);

  // Keeps a layer, unless it is hidden already. Throws LimitError when more than max_layers are in front of what is
  // opaque.
  void add_layer(const Layer& layer) {
    if (layer.z >= z[layer.sample]) return;
    if (layers.size() >= next_drop_) make_room();
    layers.push_back(layer);
  }
  // Forgets the layers that an opaque surface hides.
  void drop_hidden_layers();

  // The tile's far plane: infinity while a sample sees nothing.
  float farthest() const;

  // Bytes of the state of a machine that keeps at most `capacity` layers of a sample.
  std::uint64_t bytes(std::size_t capacity) const;

 private:
  void make_room();
  std::size_t next_drop_ = 0;  // layers at which it is worth to look for hidden ones
};

}  // namespace tessera::tilecore
