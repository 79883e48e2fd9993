#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tessera::baselines {

// A triangle by the number of its base patch and its own number there, as visibility has them.
constexpr std::uint64_t triangle_name(std::uint32_t patch, std::uint32_t triangle) {
  return static_cast<std::uint64_t>(patch) << 32 | triangle;
}

// Which triangles the samples of each tile see, blended ones included: names in rising order. What is deferred is
// fetched and shaded for these alone.
struct VisibleTriangles {
  std::vector<std::vector<std::uint64_t>> tiles;
  bool contains(std::size_t tile, std::uint64_t name) const {
    return std::binary_search(tiles[tile].begin(), tiles[tile].end(), name);
  }
};

}  // namespace tessera::baselines
