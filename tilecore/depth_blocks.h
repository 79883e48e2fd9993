#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/rect.h"

namespace tessera::tilecore {

// Hierarchical depth of a tile: the farthest depth of each block of 8x8 pixels. Depths of samples only decrease, so a
// block is scanned again only after one of its samples changed.
//
// Invariants (cited by the tests):
//   HZ1  farthest() is the farthest depth of all samples of the requested blocks; infinity while one sees no surface.
//   HZ2  Only requested blocks whose samples all see a surface, and of which a sample changed since their last scan, are
//        scanned, and counted, once each.
class DepthBlocks {
 public:
  static constexpr int kSide = 8;  // pixels

  // Starts a tile whose samples see no surface. `width`: the tile's, in pixels; `samples`: `spp` for each of its
  // pixels, row by row.
  void start(std::size_t samples, int width, int spp);

  // Notes that sample number `sample` became nearer. `first`: it saw no surface before.
  void touch(std::size_t sample, bool first) {
    const std::uint64_t pixel = sample * per_pixel_ >> 32, row = pixel * per_row_ >> 32;
    Block& block = blocks_[row / kSide * columns_ + (pixel - row * width_) / kSide];
    block.touched = true;
    if (first) --block.uncovered;
  }

  // Farthest depth of the tile, or of the blocks that hold `pixels`, counted from the tile's corner. `z`: the depths of
  // all samples.
  float farthest(std::span<const float> z) {
    return farthest(z, {0, 0, static_cast<int>(width_), static_cast<int>(height_)});
  }
  float farthest(std::span<const float> z, const IntRect& pixels);

  // Number of blocks scanned since the last call.
  std::uint64_t take_updates() { return std::exchange(updates_, 0); }

 private:
  float look_at(std::size_t block, std::span<const float> z) const;

  std::uint64_t per_pixel_ = 0, per_row_ = 0;  // 2^32 over spp and over width, rounded up: exact for 2^22 samples
  std::size_t width_ = 0, height_ = 0, spp_ = 1, columns_ = 0;
  struct Block {
    float far;
    std::uint32_t uncovered;  // samples that see no surface
    bool touched;
  };
  std::vector<Block> blocks_;
  std::uint64_t updates_ = 0;
};

}  // namespace tessera::tilecore
