#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/tessellation_pattern.h"

namespace tessera::tilecore {

// The vertices of triangles of patches' grids that were asked for, numbered from 0 in the order in which they were
// first. Grids have up to 255 cells along a side. Keeps its memory from draw to draw; one instance per thread.
class GridVertices {
 public:
  // Forgets all of them.
  void clear();
  std::size_t count() const { return count_; }
  // Numbers of the corners of a triangle of the grid of `patch`. For each vertex that had no number, make(u, v) is called
  // first, with its parameters in the patch, in the order of numbers.
  template <class Make>
  std::array<std::int32_t, 3> triangle(const scene::TessellationPattern& pattern, std::uint32_t patch,
                                       std::uint32_t triangle, const Make& make) {
    std::array<std::int32_t, 3> numbers;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = scene::grid_corner(pattern, triangle, k);
      const auto [number, is_new] = number_of(patch, i, j);
      if (is_new) make(pattern.u(i, j), pattern.v(i, j));
      numbers[k] = number;
    }
    return numbers;
  }

 private:
  // The number of the vertex `name`: its patch, and its place in the grid. Free where it is of another set.
  struct Place {
    std::uint64_t name = 0;
    std::uint32_t set = 0;
    std::int32_t number = 0;
  };
  struct Number {
    std::int32_t number;
    bool is_new;
  };
  Number number_of(std::uint32_t patch, int i, int j);
  // Its place, or a free one for it.
  Place& place_of(std::uint64_t name);
  void grow();

  std::vector<Place> places_;  // a power of two
  std::uint32_t set_ = 1;
  std::size_t count_ = 0;
};

}  // namespace tessera::tilecore
