#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
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

// Nearest 8-bit sRGB code of linear light in [0, 1]: to_unorm8(linear_to_srgb(l)), by table.
class Srgb8Encoder {
 public:
  static const Srgb8Encoder& instance() {
    static const Srgb8Encoder kEncoder;
    return kEncoder;
  }
  std::uint8_t operator()(float l) const {
    if (!(l >= kLeast)) return 0;
    if (l >= 1.0f) return 255;
    const std::size_t code = bucket_[(std::bit_cast<std::uint32_t>(l) >> 16) - (kLeastBits >> 16)];
    return static_cast<std::uint8_t>(code + (l >= first_[code + 1] ? 1 : 0) + (l >= first_[code + 2] ? 1 : 0));
  }

 private:
  // Below 2^-14 every code is 0. A bucket is 2^-7 of its numbers wide; no three codes begin in one.
  static constexpr std::uint32_t kLeastBits = 0x38800000u, kOneBits = 0x3F800000u;
  static constexpr float kLeast = 0x1p-14f;

  Srgb8Encoder() {
    const auto code_of = [](std::uint32_t bits) { return to_unorm8(linear_to_srgb(std::bit_cast<float>(bits))); };
    first_.fill(2.0f);
    first_[0] = 0.0f;
    for (std::size_t code = 1; code < 256; ++code) {
      std::uint32_t below = kLeastBits, at = kOneBits;  // the code begins in (below, at]
      while (at - below > 1) {
        const std::uint32_t middle = below + (at - below) / 2;
        (code_of(middle) >= code ? at : below) = middle;
      }
      first_[code] = std::bit_cast<float>(at);
    }
    for (std::size_t b = 0; b < bucket_.size(); ++b)
      bucket_[b] = code_of(kLeastBits + (static_cast<std::uint32_t>(b) << 16));
  }

  std::array<float, 258> first_;  // smallest number of each code
  std::array<std::uint8_t, ((0x3F800000u - 0x38800000u) >> 16)> bucket_;
};

}  // namespace tessera
