#include "tilecore/resolve/frame_format.h"

#include <algorithm>

#include "base/color.h"
#include "shaders_cpp/tone_map.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::tilecore {
namespace {

// Nearest code of a value in [0, 1]; NaN becomes 0.
std::uint16_t unorm(float value, unsigned bits) {
  const float clamped = value > 0.0f ? std::min(value, 1.0f) : 0.0f;
  return static_cast<std::uint16_t>(clamped * static_cast<float>((1u << bits) - 1) + 0.5f);
}

float from_unorm(std::uint16_t code, unsigned bits) {
  return static_cast<float>(code) / static_cast<float>((1u << bits) - 1);
}

}  // namespace

PixelCode PixelCoder::code(const Vec4& color) const {
  if (!tone_maps()) return half_bits(color);
  const Vec3 mapped = shaders::tone_map(Vec3(color) * exposure_);
  const std::uint16_t coverage = unorm(color.w, channel_bits(format_)[3]);
  if (format_ == FrameFormat::kRgba8) {
    const Srgb8Encoder& encode = Srgb8Encoder::instance();
    return {encode(mapped.x), encode(mapped.y), encode(mapped.z), coverage};
  }
  const auto channel = [&](float light) { return unorm(linear_to_srgb(light), channel_bits(format_)[0]); };
  return {channel(mapped.x), channel(mapped.y), channel(mapped.z), coverage};
}

void PixelCoder::stored(std::span<const Vec4> colors, Vec4* out) const {
  if (!tone_maps()) return as_halves(colors, out);
  for (std::size_t i = 0; i < colors.size(); ++i) out[i] = color_of(code(colors[i]));
}

Vec4 PixelCoder::color_of(const PixelCode& code) const {
  const ChannelBits bits = channel_bits(format_);
  const std::uint16_t largest = static_cast<std::uint16_t>((1u << bits[0]) - 1);
  // The tone map reaches 1 at infinite light: the largest code stands for a quarter of a step below.
  const float brightest = srgb_to_linear(1.0f - 0.25f / static_cast<float>(largest));
  const auto mapped = [&](std::size_t c) {
    if (code[c] == largest) return brightest;
    return format_ == FrameFormat::kRgba8 ? srgb8_to_linear_table()[code[c]]
                                          : srgb_to_linear(from_unorm(code[c], bits[c]));
  };
  return {shaders::inverse_tone_map({mapped(0), mapped(1), mapped(2)}) / exposure_, from_unorm(code[3], bits[3])};
}

}  // namespace tessera::tilecore
