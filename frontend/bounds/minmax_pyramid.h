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

// Smallest and largest value of a scalar texture over any footprint. Each mip level of the texture has a pyramid pair
// of its own: entry (x, y) of step s holds the minimum and maximum over a block of 2^s x 2^s of its texels. A query
// reads at most 2x2 entries of one step per wrapped piece and mip level.
//
// One pair over level 0 would serve every level (coarser texels are means of finer ones), but what the coarser level
// averaged away would stay in the bound.
class MinMaxPyramid {
 public:
  explicit MinMaxPyramid(const shaders::ScalarTexture& texture);

  // Contains every value that ScalarTexture::sample can return for coordinates in the box [low, high] at this lod,
  // rounding included: the box is widened by the filter's footprint, wrap modes respected. A box that is not finite
  // yields the range of the whole texture.
  ValueRange query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod) const;
  // The same at any lod.
  ValueRange query_all(const shaders::Sampler& sampler, Vec2 low, Vec2 high) const;
  // The same for the largest values of level 0 in the footprint of any lod up to `max_lod`.
  ValueRange query_base(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float max_lod) const;

  ValueRange whole() const;

 private:
  struct Step {
    int width, height;
    std::vector<ValueRange> entries;
  };
  using Steps = std::vector<Step>;

  static ValueRange texels(const Steps& steps, int x0, int y0, int x1, int y1);  // inclusive, inside the level
  // Over the footprint that a lookup in a level of width x height texels has, in the steps of a level at least as fine.
  static ValueRange footprint(const Steps& steps, const shaders::Sampler& sampler, Vec2 low, Vec2 high, int width,
                              int height);

  std::vector<Steps> levels_;  // per mip level of the texture
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
