#include "shaders_cpp/bloom.h"

#include <algorithm>
#include <cmath>

namespace tessera::shaders {
namespace {

constexpr float kBrightest = 65504.0f;  // the largest half float

Vec3 light_at(const Image& image, int x, int y) {
  const auto p = image.at(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1));
  Vec3 out;
  for (std::size_t c = 0; c < 3; ++c) out[static_cast<int>(c)] = p[c] > 0.0f ? std::min(p[c], kBrightest) : 0.0f;
  return out;
}

Vec2 middle(int width, int height, int x, int y) {
  return {(static_cast<float>(x) + 0.5f) / static_cast<float>(width),
          (static_cast<float>(y) + 0.5f) / static_cast<float>(height)};
}

}  // namespace

Vec3 bloom_lookup(const Image& image, float u, float v) {
  const float x = u * static_cast<float>(image.width) - 0.5f, y = v * static_cast<float>(image.height) - 0.5f;
  const float left = std::floor(x), top = std::floor(y), right_share = x - left, low_share = y - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  const Vec3 upper = light_at(image, i, j) * (1.0f - right_share) + light_at(image, i + 1, j) * right_share,
             lower = light_at(image, i, j + 1) * (1.0f - right_share) + light_at(image, i + 1, j + 1) * right_share;
  return upper * (1.0f - low_share) + lower * low_share;
}

Vec3 bloom_down(const Image& from, int width, int height, int x, int y) {
  const Vec2 at = middle(width, height, x, y),
             step(1.0f / static_cast<float>(from.width), 1.0f / static_cast<float>(from.height));
  Vec3 sum = bloom_lookup(from, at.x, at.y) * 4.0f;
  for (const float i : {-1.0f, 1.0f})
    for (const float j : {-1.0f, 1.0f}) sum += bloom_lookup(from, at.x + i * step.x, at.y + j * step.y);
  return sum * (1.0f / 8.0f);
}

Vec3 bloom_up(const Image& from, int width, int height, int x, int y) {
  const Vec2 at = middle(width, height, x, y),
             step(1.0f / static_cast<float>(from.width), 1.0f / static_cast<float>(from.height));
  Vec3 sum(0.0f);
  for (const float i : {-1.0f, 1.0f}) {
    for (const float j : {-1.0f, 1.0f})
      sum += bloom_lookup(from, at.x + 0.5f * i * step.x, at.y + 0.5f * j * step.y) * 2.0f;
    sum += bloom_lookup(from, at.x + i * step.x, at.y) + bloom_lookup(from, at.x, at.y + i * step.y);
  }
  return sum * (1.0f / 12.0f);
}

}  // namespace tessera::shaders
