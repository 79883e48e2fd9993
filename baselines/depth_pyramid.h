#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"

namespace tessera::baselines {

// Farthest depths of blocks of 8x8 pixels, of 2x2 of these, and so on up to a single value. Mesh-shader pipelines
// keep such a pyramid in memory to drop hidden meshlets [spec: HiZ; 16 bits for 8x8 pixels as Adreno's LRZ; assumed:
// 11 of them are the mantissa, which is rounded up].
//
// Invariants (cited by the tests):
//   DP1  If hides() is true for a rectangle and a depth, all samples in the rectangle see a nearer surface.
class DepthPyramid {
 public:
  // `region`: drawn pixels of the frame.
  explicit DepthPyramid(const IntRect& region);

  // Adds the depths of the blocks of a rectangle of pixels, row by row from its corner on; infinity where a sample
  // sees the environment. Rectangles come in any order and must cover the region; then call finish().
  void add(const IntRect& pixels, std::span<const float> farthest);
  void finish();

  // Whether all samples in a rectangle see surfaces nearer than a depth: four lookups in the level whose texels are
  // as large as the rectangle. Parts beside the region are not visible.
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
