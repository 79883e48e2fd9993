#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::baselines {

// Farthest depths of blocks of 8x8 pixels, and of 2x2 of these and so on up to one, as mesh-shader pipelines keep them in
// memory to drop what is hidden [spec: HiZ; 16 bits for 8x8 pixels as Adreno's LRZ; assumed: 11 of them are the mantissa,
// which is rounded up].
//
// Invariants (cited by the tests):
//   DP1  What hides() says of a rectangle and a depth holds for all samples in it: they see something nearer.
class DepthPyramid {
 public:
  // `region`: pixels of the frame that are drawn.
  explicit DepthPyramid(const IntRect& region);

  // Depths of the blocks of a rectangle of pixels, row by row from its corner on; infinity where a sample sees the
  // environment. Rectangles come in any order and cover the region; then finish().
  void add(const IntRect& pixels, std::span<const float> farthest);
  void finish();

  // Whether all that samples see in a rectangle is nearer than a depth: four lookups in the level whose texels are as large
  // as the rectangle. Parts beside the region are not seen.
  bool hides(const frontend::ScreenBounds& rectangle) const;
  // Bytes of all levels.
  std::uint64_t bytes() const;

  static constexpr int kBlockSide = 8;

 private:
  struct Level {
    int columns, rows;
    std::vector<float> farthest;
  };
  IntRect region_;
  std::vector<Level> levels_;
};

}  // namespace tessera::baselines
