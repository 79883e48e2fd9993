#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/image_codec.h"
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

// The same for i at most one period away from [0, size), without division.
inline int wrap_near_texel(Wrap wrap, int i, int size) {
  switch (wrap) {
    case Wrap::kClampToEdge:
      return i < 0 ? 0 : i >= size ? size - 1 : i;
    case Wrap::kRepeat:
      return i < 0 ? i + size : i >= size ? i - size : i;
    case Wrap::kMirroredRepeat:
      break;
  }
  if (i < 0) i = -1 - i;
  if (i >= 2 * size) i -= 2 * size;
  return i < size ? i : 2 * size - 1 - i;
}

// Where a texture coordinate lies in one level: the number of the texel at or before it, not wrapped but within one
// period of [0, size), and how far on to the next.
struct TexelPosition {
  int first;
  float weight;
};
inline TexelPosition texel_position(Wrap wrap, float coordinate, int size) {
  // Reduce to one period first: texel numbers stay exact however far out the coordinate lies.
  float reduced = coordinate < -1.0f ? -1.0f : coordinate > 2.0f ? 2.0f : coordinate;
  if (wrap == Wrap::kRepeat)
    reduced = coordinate - std::floor(coordinate);
  else if (wrap == Wrap::kMirroredRepeat)
    reduced = coordinate - 2.0f * std::floor(coordinate * 0.5f);
  if (!(reduced >= -1.0f && reduced <= 2.0f)) return {0, 0.0f};  // not finite
  const float position = reduced * static_cast<float>(size) - 0.5f, below = std::floor(position);
  return {static_cast<int>(below), position - below};
}

// The two neighbouring texels and the weight of the second.
struct TexelPair {
  int first, second;
  float weight;
};
inline TexelPair linear_texels(Wrap wrap, float coordinate, int size) {
  const TexelPosition p = texel_position(wrap, coordinate, size);
  return {wrap_near_texel(wrap, p.first, size), wrap_near_texel(wrap, p.first + 1, size), p.weight};
}

// The texels that a lookup weighs: up to four in each of up to two levels; first and second are the same where it
// takes one.
struct TexelFootprint {
  struct Level {
    int level;
    TexelPair s, t;
  };
  std::array<Level, 2> levels;
  std::size_t count = 0;
};

// How memory holds texels: in blocks of side x side of them, `bytes` each. Plain RGBA8 has blocks of one texel.
struct TexelBlocks {
  int side = 1, bytes = 4;
  bool operator==(const TexelBlocks&) const = default;
};

// A mip-mapped 8-bit RGBA texture. Levels halve with rounding down. Each texel of a level that is made here is the
// area-weighted mean, in linear light, of what it covers one level up. Immutable once built.
class Texture {
 public:
  struct Level {
    int width, height;
    std::vector<std::uint8_t> rgba;  // rows from the top
  };

  Texture(const DecodedImage& image, ColorSpace space);
  // Levels as they are, the largest first, decoded from blocks of that kind; to a single one the others are made.
  Texture(std::vector<Level> levels, ColorSpace space, TexelBlocks blocks);

  int width(int level = 0) const { return levels_[static_cast<std::size_t>(level)].width; }
  int height(int level = 0) const { return levels_[static_cast<std::size_t>(level)].height; }
  int level_count() const { return static_cast<int>(levels_.size()); }
  // True when every texel's alpha is 1.
  bool opaque() const { return opaque_; }
  TexelBlocks blocks() const { return blocks_; }

  // One texel in linear light, channels RGBA in [0, 1].
  Vec4 texel(int level, int x, int y) const;

  // Filtered colour at texture coordinates uv ((0,0) is the corner of the first texel). `lod` is log2 of the number of
  // level-0 texels per pixel; values <= 0 magnify. Coordinates that are not finite read texel 0. `footprint`, unless
  // null, becomes what was read.
  Vec4 sample(const Sampler& sampler, Vec2 uv, float lod, TexelFootprint* footprint = nullptr) const;

 private:
  void make_levels();
  Vec4 sample_level(const Sampler& sampler, bool linear, Vec2 uv, int level, TexelFootprint* footprint) const;

  ColorSpace space_;
  TexelBlocks blocks_;
  bool opaque_ = true;
  std::vector<Level> levels_;
};

// A mip-mapped texture of one float channel (the red one of an image): heights for displacement.
class ScalarTexture {
 public:
  struct Level {
    int width, height;
    std::vector<float> values;
  };

  explicit ScalarTexture(const DecodedImage& image);
  ScalarTexture(int width, int height, std::vector<float> values);

  const std::vector<Level>& levels() const { return levels_; }

  // Trilinear height; lod <= 0 reads level 0 only. Coordinates that are not finite read texel 0.
  float sample(const Sampler& sampler, Vec2 uv, float lod) const;

  // Height and its derivatives by texture coordinate: the central differences of the texels, interpolated like the
  // heights themselves, so that shading stays smooth inside a texel.
  struct Gradient {
    float height, d_s, d_t;
  };
  Gradient sample_gradient(const Sampler& sampler, Vec2 uv, float lod) const;

 private:
  float sample_level(const Sampler& sampler, Vec2 uv, std::size_t level) const;
  Gradient gradient_level(const Sampler& sampler, Vec2 uv, std::size_t level) const;
  void build_levels();

  std::vector<Level> levels_;
};

// Affine change of texture coordinates (KHR_texture_transform): uv' = matrix * uv + offset.
struct TextureTransform {
  glm::mat2 matrix{1.0f};
  Vec2 offset{0.0f};

  Vec2 apply(Vec2 uv) const { return matrix * uv + offset; }
};

}  // namespace tessera::shaders
