#include "shaders_cpp/texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/color.h"

namespace tessera::shaders {
namespace {

// Area-weighted shares of the source texels that destination texel i covers.
struct Coverage {
  int first = 0;
  std::vector<float> weights;  // sum to 1
};

std::vector<Coverage> coverage_of(int source_size, int target_size) {
  std::vector<Coverage> all(static_cast<std::size_t>(target_size));
  const double ratio = static_cast<double>(source_size) / target_size;
  for (int i = 0; i < target_size; ++i) {
    const double begin = i * ratio, end = (i + 1) * ratio;
    Coverage& c = all[static_cast<std::size_t>(i)];
    c.first = static_cast<int>(begin);
    for (int k = c.first; k < source_size && k < end; ++k) {
      const double share = std::min(end, k + 1.0) - std::max(begin, static_cast<double>(k));
      if (share > 1e-9) c.weights.push_back(static_cast<float>(share / ratio));
    }
  }
  return all;
}

// Halves an image of `channels` floats. `Pixels` gives and takes texels.
template <class Get, class Put>
void halve(int width, int height, int channels, const Get& get, const Put& put) {
  const int w = std::max(1, width / 2), h = std::max(1, height / 2);
  const std::vector<Coverage> columns = coverage_of(width, w), rows = coverage_of(height, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int c = 0; c < channels; ++c) {
        const Coverage &cx = columns[static_cast<std::size_t>(x)], &cy = rows[static_cast<std::size_t>(y)];
        float sum = 0;
        for (std::size_t j = 0; j < cy.weights.size(); ++j)
          for (std::size_t i = 0; i < cx.weights.size(); ++i)
            sum += get(cx.first + static_cast<int>(i), cy.first + static_cast<int>(j), c) *
                   (cx.weights[i] * cy.weights[j]);
        put(x, y, c, sum);
      }
}

}  // namespace

int wrap_texel(Wrap wrap, std::int64_t i, int size) {
  switch (wrap) {
    case Wrap::kClampToEdge:
      return static_cast<int>(std::clamp<std::int64_t>(i, 0, size - 1));
    case Wrap::kRepeat: {
      const std::int64_t r = i % size;
      return static_cast<int>(r < 0 ? r + size : r);
    }
    case Wrap::kMirroredRepeat: {
      const std::int64_t period = 2 * std::int64_t{size};
      std::int64_t r = i % period;
      if (r < 0) r += period;
      return static_cast<int>(r < size ? r : period - 1 - r);
    }
  }
  return 0;
}

// ---- Texture ----------------------------------------------------------------------------------------------------

Texture::Texture(const DecodedImage& image, ColorSpace space) : space_(space) {
  const int width = image.width(), height = image.height(), channels = image.channels();
  Level base{width, height,
             std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto code = [&](int c) { return to_unorm8(image.unorm(x, y, c)); };
      std::uint8_t* out =
          &base.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4];
      const bool grey = channels <= 2;
      out[0] = code(0);
      out[1] = grey ? out[0] : code(1);
      out[2] = grey ? out[0] : code(2);
      out[3] = channels == 2 ? code(1) : channels == 4 ? code(3) : 255;
      opaque_ = opaque_ && out[3] == 255;
    }
  levels_.push_back(std::move(base));
  make_levels();
}

Texture::Texture(std::vector<Level> levels, ColorSpace space, TexelBlocks blocks)
    : space_(space), blocks_(blocks), levels_(std::move(levels)) {
  for (const Level& level : levels_)
    for (std::size_t alpha = 3; alpha < level.rgba.size(); alpha += 4) opaque_ = opaque_ && level.rgba[alpha] == 255;
  if (levels_.size() == 1) make_levels();
}

void Texture::make_levels() {
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const int last = level_count() - 1;
    const int w = std::max(1, levels_.back().width / 2), h = std::max(1, levels_.back().height / 2);
    Level next{w, h, std::vector<std::uint8_t>(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4)};
    halve(
        levels_.back().width, levels_.back().height, 4, [&](int x, int y, int c) { return texel(last, x, y)[c]; },
        [&](int x, int y, int c, float value) {
          const bool encode = space_ == ColorSpace::kSrgb && c < 3;
          next.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)) * 4 +
                    static_cast<std::size_t>(c)] = to_unorm8(encode ? linear_to_srgb(value) : value);
        });
    levels_.push_back(std::move(next));
  }
}

Vec4 Texture::texel(int level, int x, int y) const {
  const Level& l = levels_[static_cast<std::size_t>(level)];
  const std::uint8_t* p =
      &l.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(l.width) + static_cast<std::size_t>(x)) * 4];
  const float alpha = static_cast<float>(p[3]) / 255.0f;
  if (space_ == ColorSpace::kSrgb) {
    const auto& table = srgb8_to_linear_table();
    return {table[p[0]], table[p[1]], table[p[2]], alpha};
  }
  return {static_cast<float>(p[0]) / 255.0f, static_cast<float>(p[1]) / 255.0f, static_cast<float>(p[2]) / 255.0f,
          alpha};
}

Vec4 Texture::sample_level(const Sampler& sampler, bool linear, Vec2 uv, int level, TexelFootprint* footprint) const {
  TexelPair s = linear_texels(sampler.wrap_s, uv.x, width(level));
  TexelPair t = linear_texels(sampler.wrap_t, uv.y, height(level));
  if (!linear) {
    s.first = s.second = s.weight < 0.5f ? s.first : s.second;
    t.first = t.second = t.weight < 0.5f ? t.first : t.second;
  }
  if (footprint != nullptr) footprint->levels[footprint->count++] = {level, s, t};
  if (!linear) return texel(level, s.first, t.first);
  const Vec4 top = texel(level, s.first, t.first) * (1.0f - s.weight) + texel(level, s.second, t.first) * s.weight;
  const Vec4 bottom = texel(level, s.first, t.second) * (1.0f - s.weight) + texel(level, s.second, t.second) * s.weight;
  return top * (1.0f - t.weight) + bottom * t.weight;
}

Vec4 Texture::sample(const Sampler& sampler, Vec2 uv, float lod, TexelFootprint* footprint) const {
  if (footprint != nullptr) footprint->count = 0;
  if (!(lod > 0.0f)) return sample_level(sampler, sampler.magnify_linear, uv, 0, footprint);
  const float last = static_cast<float>(level_count() - 1);
  const float level = std::min(lod, last);
  switch (sampler.mip) {
    case MipFilter::kNone:
      return sample_level(sampler, sampler.minify_linear, uv, 0, footprint);
    case MipFilter::kNearest:
      return sample_level(sampler, sampler.minify_linear, uv, static_cast<int>(level + 0.5f), footprint);
    case MipFilter::kLinear:
      break;
  }
  const int below = static_cast<int>(level);
  const float weight = level - static_cast<float>(below);
  const Vec4 fine = sample_level(sampler, sampler.minify_linear, uv, below, footprint);
  if (weight == 0.0f) return fine;
  return fine * (1.0f - weight) + sample_level(sampler, sampler.minify_linear, uv, below + 1, footprint) * weight;
}

// ---- ScalarTexture ----------------------------------------------------------------------------------------------

ScalarTexture::ScalarTexture(const DecodedImage& image) {
  Level base{image.width(), image.height(), {}};
  base.values.reserve(static_cast<std::size_t>(base.width) * static_cast<std::size_t>(base.height));
  for (int y = 0; y < base.height; ++y)
    for (int x = 0; x < base.width; ++x) base.values.push_back(image.unorm(x, y, 0));
  levels_.push_back(std::move(base));
  build_levels();
}

ScalarTexture::ScalarTexture(int width, int height, std::vector<float> values) {
  levels_.push_back({width, height, std::move(values)});
  build_levels();
}

void ScalarTexture::build_levels() {
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& last = levels_.back();
    const int w = std::max(1, last.width / 2), h = std::max(1, last.height / 2);
    Level next{w, h, std::vector<float>(static_cast<std::size_t>(w) * static_cast<std::size_t>(h))};
    halve(
        last.width, last.height, 1,
        [&](int x, int y, int) {
          return last
              .values[static_cast<std::size_t>(y) * static_cast<std::size_t>(last.width) + static_cast<std::size_t>(x)];
        },
        [&](int x, int y, int, float value) {
          next.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] = value;
        });
    levels_.push_back(std::move(next));
  }
}

float ScalarTexture::sample_level(const Sampler& sampler, Vec2 uv, std::size_t level) const {
  const Level& l = levels_[level];
  const TexelPair s = linear_texels(sampler.wrap_s, uv.x, l.width), t = linear_texels(sampler.wrap_t, uv.y, l.height);
  const auto value = [&](int x, int y) {
    return l.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(l.width) + static_cast<std::size_t>(x)];
  };
  const float top = value(s.first, t.first) * (1.0f - s.weight) + value(s.second, t.first) * s.weight;
  const float bottom = value(s.first, t.second) * (1.0f - s.weight) + value(s.second, t.second) * s.weight;
  return top * (1.0f - t.weight) + bottom * t.weight;
}

float ScalarTexture::sample(const Sampler& sampler, Vec2 uv, float lod) const {
  if (!(lod > 0.0f)) return sample_level(sampler, uv, 0);
  const float level = std::min(lod, static_cast<float>(levels_.size() - 1));
  const auto below = static_cast<std::size_t>(level);
  const float weight = level - static_cast<float>(below);
  const float fine = sample_level(sampler, uv, below);
  return weight == 0.0f ? fine : fine * (1.0f - weight) + sample_level(sampler, uv, below + 1) * weight;
}

ScalarTexture::Gradient ScalarTexture::gradient_level(const Sampler& sampler, Vec2 uv, std::size_t level) const {
  const Level& l = levels_[level];
  const TexelPosition s = texel_position(sampler.wrap_s, uv.x, l.width),
                      t = texel_position(sampler.wrap_t, uv.y, l.height);
  // 4 x 4 texels around the point; the inner four are interpolated, the outer ones give their differences.
  std::array<int, 4> column, row;
  for (int k = 0; k < 4; ++k) {
    column[static_cast<std::size_t>(k)] = wrap_texel(sampler.wrap_s, s.first - 1 + k, l.width);
    row[static_cast<std::size_t>(k)] = wrap_texel(sampler.wrap_t, t.first - 1 + k, l.height) * l.width;
  }
  const auto h = [&](std::size_t i, std::size_t j) { return l.values[static_cast<std::size_t>(row[j] + column[i])]; };
  const auto mix = [&](const auto& value) {
    const float top = value(1, 1) * (1.0f - s.weight) + value(2, 1) * s.weight;
    const float bottom = value(1, 2) * (1.0f - s.weight) + value(2, 2) * s.weight;
    return top * (1.0f - t.weight) + bottom * t.weight;
  };
  const float half_width = 0.5f * static_cast<float>(l.width), half_height = 0.5f * static_cast<float>(l.height);
  return {mix(h), mix([&](std::size_t i, std::size_t j) { return h(i + 1, j) - h(i - 1, j); }) * half_width,
          mix([&](std::size_t i, std::size_t j) { return h(i, j + 1) - h(i, j - 1); }) * half_height};
}

ScalarTexture::Gradient ScalarTexture::sample_gradient(const Sampler& sampler, Vec2 uv, float lod) const {
  if (!(lod > 0.0f)) return gradient_level(sampler, uv, 0);
  const float level = std::min(lod, static_cast<float>(levels_.size() - 1));
  const auto below = static_cast<std::size_t>(level);
  const float weight = level - static_cast<float>(below);
  const Gradient fine = gradient_level(sampler, uv, below);
  if (weight == 0.0f) return fine;
  const Gradient coarse = gradient_level(sampler, uv, below + 1);
  const auto mix = [&](float a, float b) { return a * (1.0f - weight) + b * weight; };
  return {mix(fine.height, coarse.height), mix(fine.d_s, coarse.d_s), mix(fine.d_t, coarse.d_t)};
}

}  // namespace tessera::shaders
