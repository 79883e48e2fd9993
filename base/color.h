#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace tessera {

// IEC 61966-2-1 transfer functions; values outside [0, 1] continue the curve.
inline float srgb_to_linear(float s) { return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f); }
inline float linear_to_srgb(float l) {
  return l <= 0.0031308f ? l * 12.92f : 1.055f * std::pow(l, 1.0f / 2.4f) - 0.055f;
}

// Nearest 8-bit code of a value in [0, 1]; NaN becomes 0.
inline std::uint8_t to_unorm8(float value) {
  const float clamped = value > 0.0f ? std::min(value, 1.0f) : 0.0f;
  return static_cast<std::uint8_t>(clamped * 255.0f + 0.5f);
}

// Linear light of every 8-bit sRGB code.
inline const std::array<float, 256>& srgb8_to_linear_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[static_cast<std::size_t>(i)] = srgb_to_linear(static_cast<float>(i) / 255.0f);
    return t;
  }();
  return table;
}

}  // namespace tessera
