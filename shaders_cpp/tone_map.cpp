#include "shaders_cpp/tone_map.h"

#include <algorithm>
#include <cmath>

#include "base/color.h"
#include "base/parallel.h"

namespace tessera::shaders {

namespace {

constexpr float kStartCompression = 0.8f - 0.04f, kDesaturation = 0.15f;
constexpr float kRoom = 1.0f - kStartCompression;  // range of compressed values

// Share of a colour with this peak that becomes white.
float white_share(float peak, float new_peak) { return 1.0f - 1.0f / (kDesaturation * (peak - new_peak) + 1.0f); }

}  // namespace

Vec3 tone_map(Vec3 color) {
  // Infinite light would make infinity minus infinity below; anything this bright is white.
  for (int i = 0; i < 3; ++i) color[i] = color[i] > 0.0f ? std::min(color[i], 1e6f) : 0.0f;
  const float smallest = std::min({color.x, color.y, color.z});
  const float offset = smallest < 0.08f ? smallest - 6.25f * smallest * smallest : 0.04f;
  color -= Vec3(offset);
  const float peak = std::max({color.x, color.y, color.z});
  if (peak < kStartCompression) return color;
  const float new_peak = 1.0f - kRoom * kRoom / (peak + kRoom - kStartCompression);
  color *= new_peak / peak;
  const float g = white_share(peak, new_peak);
  return color * (1.0f - g) + Vec3(new_peak) * g;
}

Vec3 inverse_tone_map(Vec3 color) {
  const float new_peak = std::max({color.x, color.y, color.z});
  if (new_peak >= kStartCompression) {
    const float peak = kRoom * kRoom / (1.0f - new_peak) + kStartCompression - kRoom;
    const float g = white_share(peak, new_peak);
    color = glm::max((color - Vec3(new_peak) * g) / (1.0f - g), Vec3(0.0f)) * (peak / new_peak);
  }
  const float smallest = std::min({color.x, color.y, color.z});
  // 6.25 * 0.08^2 = 0.08 - 0.04
  return color + Vec3(smallest < 0.04f ? 0.4f * std::sqrt(smallest) - smallest : 0.04f);
}

Image8 to_display(const Image& linear, float exposure) {
  Image8 out(linear.width, linear.height, 3);
  const Srgb8Encoder& encode = Srgb8Encoder::instance();
  parallel_for(static_cast<std::size_t>(linear.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < linear.width; ++x) {
      const auto in = linear.at(x, y);
      const Vec3 mapped = tone_map(Vec3(in[0], in[1], in[2]) * exposure);
      const auto pixel = out.at(x, y);
      for (int c = 0; c < 3; ++c) pixel[static_cast<std::size_t>(c)] = encode(mapped[c]);
    }
  });
  return out;
}

}  // namespace tessera::shaders
