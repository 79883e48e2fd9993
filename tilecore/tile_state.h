#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::tilecore {

// What the samples of a tile see. Survives partial renders, when it is stored to memory and loaded again.
struct TileState {
  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFFu;
  static constexpr std::uint64_t kBytesPerSample = 20;   // z, patch, triangle, two weights
  static constexpr std::uint64_t kBytesPerLayer = 24;    // the same and the sample's number

  // Nearest opaque surface per sample, natural order.
  std::vector<float> z, b1, b2, rest_x, rest_y;
  std::vector<std::uint32_t> patch, triangle;

  // Blended surfaces in front of it, in any order until the tile is finished.
  struct Layer {
    std::uint32_t sample, patch, triangle;
    float z, b1, b2, rest_x, rest_y;
  };
  std::vector<Layer> layers;

  bool started = false;
  void start(std::size_t samples);
};

}  // namespace tessera::tilecore
