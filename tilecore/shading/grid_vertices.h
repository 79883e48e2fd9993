#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/tessellation_pattern.h"

namespace tessera::tilecore {

// The requested vertices of triangles of patches' grids, numbered from 0 in the order of first requests. Grids have up
// to 255 cells along a side. Keeps its memory from draw to draw; one instance per thread.
class GridVertices {
 public:
  // Forgets all vertices.
  void clear();
  std::size_t count() const { return count_; }
  // Returns the numbers of the corners of a triangle of the grid of `patch`. For each vertex without a number it first
  // calls make(u, v), with its parameters in the patch, in the order of numbers.
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
  static constexpr int kSide = 8;
  static constexpr std::int32_t kNone = -1;
  // A square of kSide x kSide vertices of a patch's grid, `name`: the place of their numbers. It is free if it belongs
  // to another set.
  struct Block {
    std::uint64_t name = 0;
    std::uint32_t set = 0, first = 0;
  };
  struct Number {
    std::int32_t number;
    bool is_new;
  };
  Number number_of(std::uint32_t patch, int i, int j) {
    const std::uint64_t name = std::uint64_t{patch} << 32 | static_cast<std::uint32_t>((j / kSide) << 16 | i / kSide);
    if (name != last_name_) last_first_ = first_of(name), last_name_ = name;
    std::int32_t& number = numbers_[last_first_ + static_cast<std::size_t>(j % kSide * kSide + i % kSide)];
    const bool is_new = number == kNone;
    if (is_new) number = static_cast<std::int32_t>(count_++);
    return {number, is_new};
  }
  // Returns the place of a block's numbers; makes one if there is none.
  std::uint32_t first_of(std::uint64_t name);
  // Returns the block of that name, or a free one for it.
  Block& block_of(std::uint64_t name);
  void grow();

  static constexpr std::uint64_t kNoName = ~std::uint64_t{0};
  std::vector<Block> blocks_;  // a power of two
  std::size_t used_ = 0;       // blocks of the set
  std::vector<std::int32_t> numbers_;
  std::uint32_t set_ = 1;
  std::size_t count_ = 0;
  std::uint64_t last_name_ = kNoName;
  std::uint32_t last_first_ = 0;
};

}  // namespace tessera::tilecore
