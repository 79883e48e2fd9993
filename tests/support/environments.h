#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "base/image.h"
#include "base/random.h"
#include "base/vec.h"
#include "shaders_cpp/environment_image.h"

namespace tessera::test {

// Direction of a pixel's middle: +x in the middle of the image, +y at its top, +z a quarter of it further right.
inline DVec3 sky_direction(int x, int y, int height) {
  const double angle = ((x + 0.5) / (2 * height) - 0.5) * 2 * std::numbers::pi,
               down = (y + 0.5) / height * std::numbers::pi;
  return {std::sin(down) * std::cos(angle), std::cos(down), std::sin(down) * std::sin(angle)};
}

// An equirectangular image; `light(direction)` gives a DVec3.
template <class Light>
Image sky_image(int height, const Light& light) {
  Image image(2 * height, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < 2 * height; ++x) {
      const DVec3 color = light(sky_direction(x, y, height));
      for (std::size_t c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(color[static_cast<int>(c)]);
    }
  return image;
}

inline Image noise_sky(int height, std::uint32_t seed) {
  Image image(2 * height, height, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<float>(hash32(static_cast<std::uint32_t>(i), seed) >> 8) * 0x1p-22f;
  return image;
}
inline std::shared_ptr<const shaders::EnvironmentImage> noisy_environment(int height, std::uint32_t seed) {
  return std::make_shared<const shaders::EnvironmentImage>(noise_sky(height, seed), 0.0);
}
inline shaders::Surroundings surroundings_of(const shaders::EnvironmentImage& image, float intensity = 1.0f) {
  return {shaders::Surroundings::Kind::kImage, intensity, &image};
}

}  // namespace tessera::test
