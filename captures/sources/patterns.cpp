#include "captures/sources/patterns.h"

#include <algorithm>
#include <cmath>

#include "base/color.h"
#include "base/random.h"

namespace tessera::captures {
namespace {

template <class Put>
void each_texel(int width, int height, const Put& put) {
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      put(x, y, static_cast<float>(x) / static_cast<float>(width), static_cast<float>(y) / static_cast<float>(height));
}

float unit_hash(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return static_cast<float>(hash32(a, b, c) >> 8) * 0x1p-24f;
}

std::uint32_t wrapped(int i, int n) { return static_cast<std::uint32_t>(((i % n) + n) % n); }

}  // namespace

Image8 color_image(int width, int height, const std::function<Vec3(float, float)>& srgb) {
  Image8 out(width, height, 3);
  each_texel(width, height, [&](int x, int y, float u, float v) {
    const Vec3 c = srgb(u, v);
    for (int k = 0; k < 3; ++k) out.at(x, y)[static_cast<std::size_t>(k)] = to_unorm8(c[k]);
  });
  return out;
}

Image8 data_image(int width, int height, const std::function<Vec3(float, float)>& value) {
  return color_image(width, height, value);
}

Image8 grey_image(int width, int height, const std::function<float(float, float)>& value) {
  Image8 out(width, height, 1);
  each_texel(width, height, [&](int x, int y, float u, float v) { out.at(x, y)[0] = to_unorm8(value(u, v)); });
  return out;
}

Image16 height_image(int width, int height, const std::function<float(float, float)>& value) {
  Image16 out(width, height, 1);
  each_texel(width, height, [&](int x, int y, float u, float v) {
    // 12 significant bits: finer than any displacement here, and the file stays small.
    out.at(x, y)[0] =
        static_cast<std::uint16_t>(static_cast<int>(std::clamp(value(u, v), 0.0f, 1.0f) * 4095.0f + 0.5f) << 4);
  });
  return out;
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

Vec3 mix(Vec3 a, Vec3 b, float t) { return a * (1.0f - t) + b * t; }

float noise(float u, float v, int cell_count, int octaves, std::uint32_t seed) {
  float sum = 0, weight = 0.5f, total = 0;
  for (int octave = 0; octave < octaves; ++octave, cell_count *= 2, weight *= 0.5f) {
    const float x = u * static_cast<float>(cell_count), y = v * static_cast<float>(cell_count);
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    const float fx = smooth_step(0, 1, x - static_cast<float>(ix)), fy = smooth_step(0, 1, y - static_cast<float>(iy));
    const auto at = [&](int dx, int dy) {
      return unit_hash(seed + static_cast<std::uint32_t>(octave), wrapped(ix + dx, cell_count),
                       wrapped(iy + dy, cell_count));
    };
    sum += weight * ((at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy);
    total += weight;
  }
  return sum / total;
}

Cell cells(float u, float v, int count_u, int count_v, float jitter, std::uint32_t seed) {
  const float x = u * static_cast<float>(count_u), y = v * static_cast<float>(count_v);
  const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
  Cell best{10.0f, 10.0f, 0};
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) {
      const std::uint32_t cx = wrapped(ix + dx, count_u), cy = wrapped(iy + dy, count_v);
      const float px = static_cast<float>(ix + dx) + 0.5f + jitter * (unit_hash(seed, cx, cy) - 0.5f);
      const float py = static_cast<float>(iy + dy) + 0.5f + jitter * (unit_hash(seed + 1, cx, cy) - 0.5f);
      const float distance = std::hypot(px - x, py - y);
      if (distance < best.nearest)
        best = {distance, best.nearest, cy * static_cast<std::uint32_t>(count_u) + cx};
      else
        best.second = std::min(best.second, distance);
    }
  return best;
}

float scales(float u, float v) {
  // A scale hangs from its middle and covers the scale below; the highest of the candidates wins.
  float best = 0.0f;
  for (int row = -1; row <= 3; ++row)
    for (int column = -1; column <= 1; ++column) {
      const float cx = static_cast<float>(column) + (row & 1 ? 0.5f : 0.0f) + 0.25f,
                  cy = static_cast<float>(row) * 0.5f;
      const float dx = (u - cx) * 2.0f, dy = (v - cy) * 1.15f;  // dy grows downwards: the tip
      const float reach = dx * dx + dy * dy * 1.6f;
      if (dy < -0.35f || reach > 1.0f) continue;
      // Rises towards the tip, with a rounded rim and a ridge.
      const float rim = smooth_step(1.0f, 0.72f, reach);
      const float body =
          0.35f + 0.55f * smooth_step(-0.4f, 0.75f, dy) + 0.10f * (1.0f - smooth_step(0.0f, 0.25f, std::abs(dx)));
      best = std::max(best, rim * body);
    }
  return best;
}

Image8 contact_shade(const std::vector<Blob>& blobs, Vec2 low, Vec2 high) {
  return grey_image(256, 192, [&](float u, float v) {
    const Vec2 p = low + (high - low) * Vec2(u, v);
    float light = 1.0f;
    for (const Blob& b : blobs) {
      const Vec2 away = p - b.at, drawn = away - Vec2(0.35f, 0.32f) * b.radius;
      light *= 1.0f - 0.92f * std::exp(-1.5f * glm::dot(away, away) / (b.radius * b.radius));
      light *= 1.0f - 0.65f * std::exp(-0.9f * glm::dot(drawn, drawn) / (b.radius * b.radius));
    }
    return light;
  });
}

}  // namespace tessera::captures
