#include "gpu/bloom.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/parallel.h"
#include "shaders_cpp/bloom.h"

namespace tessera::gpu {
namespace {

// Nearest value of a float with five bits of exponent and `bits` of mantissa; light is not negative.
float rounded(float value, int bits) {
  if (!(value > 0.0f)) return 0.0f;
  int exponent = 0;
  std::frexp(value, &exponent);
  const float step = std::ldexp(1.0f, std::max(exponent - 1, -14) - bits),
              largest = (2.0f - std::ldexp(1.0f, -bits)) * 32768.0f;
  return std::min(std::nearbyint(value / step) * step, largest);
}

}  // namespace

Vec3 rounded_to(scene::AttachmentFormat format, const Vec3& light) {
  if (format == scene::AttachmentFormat::kR11G11B10F)
    return {rounded(light.x, 6), rounded(light.y, 6), rounded(light.z, 5)};
  return {rounded(light.x, 10), rounded(light.y, 10), rounded(light.z, 10)};
}

Bloom::Bloom(std::string name, const tilecore::ColorAttachment& source, scene::AttachmentFormat format, double scale,
             int levels, int width, int height)
    : name_(std::move(name)), source_(source), format_(format), width_(width), height_(height) {
  const auto scaled = [&](int side) { return std::max(1, static_cast<int>(scale * side)); };
  for (int level = 0; level < levels; ++level) {
    const std::array<int, 2> size =
        level == 0 ? std::array{scaled(width), scaled(height)}
                   : std::array{std::max(1, sizes_.back()[0] / 2), std::max(1, sizes_.back()[1] / 2)};
    sizes_.push_back(size);
    steps_.push_back({fmt::format("{} down {}", name_, level), static_cast<std::size_t>(level), false});
  }
  for (int level = levels - 2; level >= 0; --level)
    steps_.push_back({fmt::format("{} up {}", name_, level), static_cast<std::size_t>(level), true});
}

tilecore::TexelFormat Bloom::texel_format() const {
  return {.planes = {format_ == scene::AttachmentFormat::kR11G11B10F
                         ? tilecore::kSmallFloatsBlock
                         : tilecore::stored_block(tilecore::FrameFormat::kRgba16f)}};
}

tilecore::PixelCode Bloom::code(std::span<const float> light) const {
  const std::array<std::uint16_t, 3> half{tilecore::half_bits(light[0]), tilecore::half_bits(light[1]),
                                          tilecore::half_bits(light[2])};
  if (format_ != scene::AttachmentFormat::kR11G11B10F) return {half[0], half[1], half[2], 0};
  // Small floats have the exponent of a half, no sign, and fewer bits of the mantissa.
  return {static_cast<std::uint16_t>(half[0] >> 4), static_cast<std::uint16_t>(half[1] >> 4),
          static_cast<std::uint16_t>(half[2] >> 5), 0};
}

IntRect Bloom::part(std::array<int, 2> size, IntRect pixels) const {
  const auto first = [](int pixel, int texels, int all) {
    return static_cast<int>((std::int64_t{pixel} * texels + all - 1) / all);
  };
  return {first(pixels.x0, size[0], width_), first(pixels.y0, size[1], height_), first(pixels.x1, size[0], width_),
          first(pixels.y1, size[1], height_)};
}

void Bloom::run(const BloomStep& step, const Image& frame, std::vector<Image>& images) const {
  images.resize(levels());
  const auto [width, height] = sizes_[step.level];
  Image& to = images[step.level];
  if (!step.up) to = Image(width, height, 3);
  const Image& from = step.up ? images[step.level + 1] : step.level == 0 ? frame : images[step.level - 1];
  // `from` holds the mean of the levels below; its weight is their number.
  const float below = static_cast<float>(levels() - 1 - step.level);
  const int w = width, h = height;
  parallel_for(static_cast<std::size_t>(height), [&, w, h](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < w; ++x) {
      const auto texel = to.at(x, y);
      Vec3 light;
      if (step.up)
        light = (Vec3(texel[0], texel[1], texel[2]) + shaders::bloom_up(from, w, h, x, y) * below) / (below + 1.0f);
      else
        light = shaders::bloom_down(from, w, h, x, y);
      light = rounded_to(format_, light);
      for (std::size_t c = 0; c < 3; ++c) texel[c] = light[static_cast<int>(c)];
    }
  });
}

}  // namespace tessera::gpu
