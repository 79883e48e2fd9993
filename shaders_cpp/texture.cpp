#include "shaders_cpp/texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/color.h"
#include "base/parallel.h"

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

// Halves an image of `channels` floats. `get` reads and `put` writes texels, on any thread.
template <class Get, class Put>
void halve(int width, int height, int channels, const Get& get, const Put& put) {
  const int w = std::max(1, width / 2), h = std::max(1, height / 2);
  const std::vector<Coverage> columns = coverage_of(width, w), rows = coverage_of(height, h);
  const auto make_row = [&](std::size_t row) {
    const int y = static_cast<int>(row);
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
  };
  constexpr int kWorthThreads = 1 << 12;  // texels
  if (std::int64_t{w} * h >= kWorthThreads)
    parallel_for(static_cast<std::size_t>(h), make_row);
  else
    for (int y = 0; y < h; ++y) make_row(static_cast<std::size_t>(y));
}

// Number of texels of a level in whole squares of 4 x 4.
std::size_t texels_of_squares(const Texture::Level& level) {
  return std::size_t{16} * static_cast<std::size_t>((level.width + 3) / 4) *
         static_cast<std::size_t>((level.height + 3) / 4);
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
    }
  add_level(base);
  make_levels(std::move(base));
}

Texture::Texture(std::vector<Level> levels, ColorSpace space, TexelBlocks blocks) : space_(space), blocks_(blocks) {
  std::size_t texels = 0;
  for (const Level& level : levels) texels += texels_of_squares(level);
  texels_.reserve(texels);
  for (const Level& level : levels) add_level(level);
  if (levels.size() == 1) make_levels(std::move(levels.front()));
}

void Texture::add_level(const Level& level) {
  const auto first = texels_.size();
  const int across = (level.width + 3) / 4;
  texels_.resize(first + texels_of_squares(level));
  for (int y = 0; y < level.height; ++y)
    for (int x = 0; x < level.width; ++x) {
      const std::uint8_t* p = &level.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                                           static_cast<std::size_t>(x)) *
                                          4];
      opaque_ = opaque_ && p[3] == 255;
      const auto code = [&](int c) { return std::uint32_t{p[c]} << (8 * c); };
      texels_[first + static_cast<std::size_t>(((y / 4) * across + x / 4) * 16 + (y % 4) * 4 + x % 4)] =
          static_cast<std::int32_t>(code(0) | code(1) | code(2) | code(3));
    }
  width_.push_back(level.width);
  height_.push_back(level.height);
  first_.push_back(static_cast<std::int32_t>(first));
  squares_across_.push_back(across);
}

void Texture::make_levels(Level base) {
  const auto& table = srgb8_to_linear_table();
  while (base.width > 1 || base.height > 1) {
    const int w = std::max(1, base.width / 2), h = std::max(1, base.height / 2);
    Level next{w, h, std::vector<std::uint8_t>(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4)};
    halve(
        base.width, base.height, 4,
        [&](int x, int y, int c) {
          const std::uint8_t code = base.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(base.width) +
                                               static_cast<std::size_t>(x)) *
                                                  4 +
                                              static_cast<std::size_t>(c)];
          return space_ == ColorSpace::kSrgb && c < 3 ? table[code] : static_cast<float>(code) / 255.0f;
        },
        [&](int x, int y, int c, float value) {
          const bool encode = space_ == ColorSpace::kSrgb && c < 3;
          next.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)) * 4 +
                    static_cast<std::size_t>(c)] = to_unorm8(encode ? linear_to_srgb(value) : value);
        });
    add_level(next);
    base = std::move(next);
  }
}

Texture::Level Texture::stored_level(int number) const {
  const auto l = static_cast<std::size_t>(number);
  Level level{width_[l], height_[l], {}};
  level.rgba.reserve(std::size_t{4} * static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height));
  for (int y = 0; y < level.height; ++y)
    for (int x = 0; x < level.width; ++x) {
      const auto texel = static_cast<std::uint32_t>(texels_[place(l, x, y)]);
      for (unsigned c = 0; c < 4; ++c) level.rgba.push_back(static_cast<std::uint8_t>(texel >> (8 * c)));
    }
  return level;
}

TextureView Texture::view() const {
  return {texels_.data(),         width_.data(),
          height_.data(),         first_.data(),
          squares_across_.data(), srgb8_to_linear_table().data(),
          level_count(),          space_ == ColorSpace::kSrgb};
}

Vec4 Texture::texel(int level, int x, int y) const {
  const auto l = static_cast<std::size_t>(level);
  const ColorOf<float> c = texel_color<float>(view(), static_cast<std::int32_t>(place(l, x, y)));
  if (space_ == ColorSpace::kSrgb) return {c.r, c.g, c.b, c.a / 255.0f};
  return {c.r / 255.0f, c.g / 255.0f, c.b / 255.0f, c.a / 255.0f};
}

Vec4 Texture::sample(const Sampler& sampler, Vec2 uv, float lod, TexelFootprint* footprint) const {
  LookupTexels<std::int32_t> read;
  const ColorOf<float> c = sample_texture<float, std::int32_t>(view(), sampler, uv.x, uv.y, lod, read);
  if (footprint != nullptr) {
    footprint->levels = {read.fine, read.coarse};
    footprint->count = read.coarse.level < 0 ? 1 : 2;
  }
  return {c.r, c.g, c.b, c.a};
}

// ---- ScalarTexture ----------------------------------------------------------------------------------------------

ScalarTexture::ScalarTexture(const DecodedImage& image) {
  values_.reserve(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) * 4 / 3 + 16);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) values_.push_back(image.unorm(x, y, 0));
  build_levels(image.width(), image.height());
}

ScalarTexture::ScalarTexture(int width, int height, std::vector<float> values) : values_(std::move(values)) {
  build_levels(width, height);
}

void ScalarTexture::build_levels(int width, int height) {
  const auto pixels = [](int w, int h) { return static_cast<std::size_t>(w) * static_cast<std::size_t>(h); };
  width_.push_back(width), height_.push_back(height), first_.push_back(0);
  if (const auto [low, high] = std::minmax_element(values_.begin(), values_.end()); low != values_.end())
    lowest_ = *low, highest_ = *high;
  std::size_t first = 0;
  while (width > 1 || height > 1) {
    const int w = std::max(1, width / 2), h = std::max(1, height / 2);
    const std::size_t next = first + pixels(width, height);
    values_.resize(next + pixels(w, h));
    halve(
        width, height, 1,
        [&](int x, int y, int) {
          return values_[first + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)];
        },
        [&](int x, int y, int, float value) {
          values_[next + static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] =
              value;
        });
    width = w, height = h, first = next;
    width_.push_back(w), height_.push_back(h), first_.push_back(static_cast<std::int32_t>(first));
  }
  for (std::size_t l = 0; l < width_.size(); ++l)
    levels_.push_back({width_[l], height_[l],
                       std::span(values_).subspan(static_cast<std::size_t>(first_[l]), pixels(width_[l], height_[l]))});
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

}  // namespace tessera::shaders
