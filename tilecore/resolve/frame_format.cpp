#include "tilecore/resolve/frame_format.h"

#include <algorithm>

#include "base/color.h"
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
  if (!quantises()) return half_bits(color);
  const ChannelBits bits = channel_bits(format_);
  PixelCode out{};
  for (int c = 0; c < 3; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    const float light = color[c] * exposure_;
    // Negative light has no power; NaN fails the comparison.
    out[channel] = light > 0.0f ? unorm(linear_to_srgb(std::min(light, 1.0f)), bits[channel]) : std::uint16_t{0};
  }
  out[3] = unorm(color.w, bits[3]);
  return out;
}

Vec4 PixelCoder::color_of(const PixelCode& code) const {
  const ChannelBits bits = channel_bits(format_);
  const auto light = [&](std::size_t c) { return srgb_to_linear(from_unorm(code[c], bits[c])) / exposure_; };
  return {light(0), light(1), light(2), from_unorm(code[3], bits[3])};
}

}  // namespace tessera::tilecore
