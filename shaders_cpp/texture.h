#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/image_codec.h"
#include "base/real.h"
#include "base/vec.h"

namespace tessera::shaders {

enum class Wrap : std::uint8_t { kRepeat, kMirroredRepeat, kClampToEdge };
enum class MipFilter : std::uint8_t { kNone, kNearest, kLinear };

// Sampling state, as glTF's sampler objects define it.
struct Sampler {
  Wrap wrap_s = Wrap::kRepeat;
  Wrap wrap_t = Wrap::kRepeat;
  bool magnify_linear = true;
  bool minify_linear = true;
  MipFilter mip = MipFilter::kLinear;
};

enum class ColorSpace : std::uint8_t { kLinear, kSrgb };

// Texel index of coordinate i outside or inside [0, size), by the wrap mode.
int wrap_texel(Wrap wrap, std::int64_t i, int size);

// Textures in the form that lookups read: plain arrays, with numbers by level.
struct TextureView {
  const std::int32_t* texels;  // RGBA8, R lowest
  const std::int32_t *width, *height;
  const std::int32_t *first, *squares_across;  // place of a level's first texel; squares of 4 x 4 texels in a row
  const float* linear;                         // linear value of each sRGB code
  int levels;
  bool srgb;
};
struct HeightView {
  const float* values;
  const std::int32_t *width, *height, *first;
  int levels;
};

namespace scalar {
#include "shaders_cpp/texture_sampling.inc"
}  // namespace scalar
using namespace scalar;

using TexelPosition = TexelPositionOf<float, std::int32_t>;
using TexelPair = TexelPairOf<float, std::int32_t>;

// The texels that a lookup weighs: up to four in each of up to two levels. If a level needs a single column or row, both are the same.
struct TexelFootprint {
  std::array<LevelTexels<std::int32_t>, 2> levels;
  std::size_t count = 0;
};

// Storage of texels in memory: blocks of side x side texels, `bytes` each. Plain RGBA8 has blocks of one texel.
struct TexelBlocks {
  int side = 1, bytes = 4;
  bool operator==(const TexelBlocks&) const = default;
};

// A mip-mapped 8-bit RGBA texture. Levels halve, rounding down. Each texel of a computed level is the area-weighted
// mean, in linear light, of the texels that it covers one level up. Texels lie in squares of 4 x 4, 64 bytes, as the
// emulated memory holds plain ones. Immutable once built.
class Texture {
 public:
  struct Level {
    int width, height;
    std::vector<std::uint8_t> rgba;  // rows from the top
  };

  Texture(const DecodedImage& image, ColorSpace space);
  // Takes given levels, the largest first, decoded from `blocks`; a single one is completed by computed levels.
  Texture(std::vector<Level> levels, ColorSpace space, TexelBlocks blocks);

  int width(int level = 0) const { return width_[static_cast<std::size_t>(level)]; }
  int height(int level = 0) const { return height_[static_cast<std::size_t>(level)]; }
  int level_count() const { return static_cast<int>(width_.size()); }
  // A level's texels in stored form.
  Level stored_level(int level) const;
  ColorSpace color_space() const { return space_; }
  // Whether every texel's alpha is 1.
  bool opaque() const { return opaque_; }
  TexelBlocks blocks() const { return blocks_; }

  // One texel in linear light, channels RGBA in [0, 1].
  Vec4 texel(int level, int x, int y) const;

  // Filtered colour at texture coordinates uv ((0,0) is the corner of the first texel). `lod` is log2 of the number
  // of level-0 texels per pixel; values <= 0 magnify. Coordinates that are not finite read texel 0. `footprint`,
  // unless nullptr, returns the texels that were read.
  Vec4 sample(const Sampler& sampler, Vec2 uv, float lod, TexelFootprint* footprint = nullptr) const;

  TextureView view() const;

 private:
  void make_levels(Level base);
  void add_level(const Level& level);
  // Index in texels_.
  std::size_t place(std::size_t level, int x, int y) const {
    return static_cast<std::size_t>(first_[level] + ((y / 4) * squares_across_[level] + x / 4) * 16 + y % 4 * 4 +
                                    x % 4);
  }

  ColorSpace space_;
  TexelBlocks blocks_;
  bool opaque_ = true;
  std::vector<std::int32_t> texels_, width_, height_, first_, squares_across_;
};

// A mip-mapped texture of one float channel (an image's red one): heights for displacement.
class ScalarTexture {
 public:
  struct Level {
    int width, height;
    std::span<const float> values;  // rows from the top
  };

  explicit ScalarTexture(const DecodedImage& image);
  ScalarTexture(int width, int height, std::vector<float> values);
  ScalarTexture(ScalarTexture&&) = default;  // not copyable, as levels point into the values

  const std::vector<Level>& levels() const { return levels_; }
  // Least and greatest of all heights; further levels are means of the first.
  float lowest() const { return lowest_; }
  float highest() const { return highest_; }

  // Trilinear height; lod <= 0 reads level 0 only. Coordinates that are not finite read texel 0.
  float sample(const Sampler& sampler, Vec2 uv, float lod) const;

  // See HeightGradient.
  HeightGradient<float> sample_gradient(const Sampler& sampler, Vec2 uv, float lod) const {
    return height_gradient(view(), sampler, uv.x, uv.y, lod);
  }

  HeightView view() const {
    return {values_.data(), width_.data(), height_.data(), first_.data(), static_cast<int>(levels_.size())};
  }

 private:
  float sample_level(const Sampler& sampler, Vec2 uv, std::size_t level) const;
  void build_levels(int width, int height);

  std::vector<float> values_;  // values of all levels
  float lowest_ = 0, highest_ = 0;
  std::vector<std::int32_t> width_, height_, first_;
  std::vector<Level> levels_;
};

// Affine change of texture coordinates (KHR_texture_transform): uv' = matrix * uv + offset.
struct TextureTransform {
  glm::mat2 matrix{1.0f};
  Vec2 offset{0.0f};

  Vec2 apply(Vec2 uv) const { return matrix * uv + offset; }
};

}  // namespace tessera::shaders
