#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include <fmt/format.h>

#include "base/image.h"

namespace tessera::test {

// Four bytes of Radiance's format.
inline std::array<std::uint8_t, 4> rgbe(float r, float g, float b) {
  const float most = std::max({r, g, b});
  if (most < 1e-32f) return {0, 0, 0, 0};
  int exponent;
  const float scale = std::frexp(most, &exponent) * 256.0f / most;
  const auto byte = [&](float v) { return static_cast<std::uint8_t>(v * scale); };
  return {byte(r), byte(g), byte(b), static_cast<std::uint8_t>(exponent + 128)};
}

// A whole file, its pixels flat.
inline std::string hdr_file(const Image& image) {
  std::string bytes =
      fmt::format("#?RADIANCE\n# made by a test\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", image.height, image.width);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto pixel = image.at(x, y);
      for (const std::uint8_t byte : rgbe(pixel[0], pixel[1], pixel[2])) bytes.push_back(static_cast<char>(byte));
    }
  return bytes;
}

}  // namespace tessera::test
