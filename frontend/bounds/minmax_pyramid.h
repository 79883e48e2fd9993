#pragma once

#include <vector>

#include "base/vec.h"
#include "shaders_cpp/texture.h"

namespace tessera::frontend {

// A closed range of values.
struct ValueRange {
  float low = 0, high = 0;

  ValueRange hull(const ValueRange& o) const { return {std::min(low, o.low), std::max(high, o.high)}; }
};

// Smallest and largest value of a scalar texture over any footprint, from two mip pyramids: level L holds the minimum
// and maximum over blocks of 2^L x 2^L texels of level 0. A query reads at most 2x2 entries of one level per wrapped
// piece. Mip levels of the texture are means of level 0, so this one pair serves every level of detail.
class MinMaxPyramid {
 public:
  explicit MinMaxPyramid(const shaders::ScalarTexture& texture);

  // Contains every value that ScalarTexture::sample can return for coordinates in the box [low, high] at any lod up to
  // `max_lod`, rounding included: the box is widened by the filter's footprint at that level, wrap modes respected.
  // A box that is not finite yields the range of the whole texture.
  ValueRange query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float max_lod) const;

  ValueRange whole() const;

 private:
  struct Level {
    int width, height;
    std::vector<ValueRange> entries;
  };
  ValueRange texels(int x0, int y0, int x1, int y1) const;  // inclusive, inside level 0

  std::vector<Level> levels_;
  std::vector<std::pair<int, int>> texture_sizes_;  // of the texture's own mip levels
};

// Steepness of a scalar texture over any footprint: largest differences of neighbouring texels, in two pyramids. A
// coarser mip level's texels are means over its cells, so that its differences, per texture coordinate, are no larger.
class SlopePyramid {
 public:
  explicit SlopePyramid(const shaders::ScalarTexture& texture);

  // Largest |change of the filtered value| per unit of each texture coordinate over the box, at any lod up to
  // `max_lod`, wrap modes and rounding included.
  Vec2 query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float max_lod) const;

 private:
  Vec2 size_;
  MinMaxPyramid along_s_, along_t_;
};

}  // namespace tessera::frontend
