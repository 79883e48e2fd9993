#include "shaders_cpp/taa.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tessera::shaders {
namespace {

constexpr float kLargestHalf = 65504.0f;  // the largest half float

float valid_light(float value) { return value > 0.0f ? std::min(value, kLargestHalf) : 0.0f; }

Vec4 clean_color(const Image& image, int x, int y) {
  const auto p = image.at(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1));
  return {valid_light(p[0]), valid_light(p[1]), valid_light(p[2]), valid_light(p[3])};
}

// One bilinear lookup of the texture unit.
Vec4 bilinear_tap(const Image& image, float u, float v) {
  const float x = u - 0.5f, y = v - 0.5f, left = std::floor(x), top = std::floor(y), s = x - left, t = y - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  const Vec4 upper = clean_color(image, i, j) * (1.0f - s) + clean_color(image, i + 1, j) * s,
             lower = clean_color(image, i, j + 1) * (1.0f - s) + clean_color(image, i + 1, j + 1) * s;
  return upper * (1.0f - t) + lower * t;
}

// Along one axis: places of three lookups that stand for four texels, and their weights.
struct CatmullRomTaps {
  std::array<float, 3> place, weight;

  explicit CatmullRomTaps(float at) {
    const float middle = std::floor(at - 0.5f) + 0.5f, f = at - middle;
    const float w0 = f * (-0.5f + f * (1.0f - 0.5f * f)), w1 = 1.0f + f * f * (-2.5f + 1.5f * f),
                w2 = f * (0.5f + f * (2.0f - 1.5f * f)), w3 = f * f * (-0.5f + 0.5f * f);
    place = {middle - 1.0f, middle + w2 / (w1 + w2), middle + 2.0f};
    weight = {w0, w1 + w2, w3};
  }
};

}  // namespace

Vec3 clip_to_box(const Vec3& color, const Vec3& low, const Vec3& high) {
  const Vec3 middle = (low + high) * 0.5f, half = (high - low) * 0.5f, from = color - middle;
  float times = 1.0f;  // how far outside, in half sides of the box
  for (int c = 0; c < 3; ++c)
    if (color[c] < low[c] || color[c] > high[c])
      times = std::max(times, half[c] > 0.0f ? std::abs(from[c]) / half[c] : std::numeric_limits<float>::infinity());
  return times > 1.0f ? middle + from / times : color;
}

Vec2 nearest_velocity(const TaaImages& images, int x, int y) {
  const auto key = [&](int i, int j) {
    if (images.depth != nullptr) return -images.depth->at(i, j)[0];
    const auto v = images.velocity.at(i, j);
    return v[0] * v[0] + v[1] * v[1];
  };
  int best_x = x, best_y = y;
  float best = key(x, y);
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, images.velocity.height - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, images.velocity.width - 1); ++i)
      if (const float other = key(i, j); other > best) best = other, best_x = i, best_y = j;
  const auto v = images.velocity.at(best_x, best_y);
  return {v[0], v[1]};
}

Vec4 taa_lookup(const Image& image, Vec2 at) {
  const CatmullRomTaps x(at.x), y(at.y);
  Vec4 sum(0.0f);
  float weights = 0.0f;
  // A cross: the corners of the nine have small weights.
  for (const auto& [i, j] : {std::array<std::size_t, 2>{1, 0}, {0, 1}, {1, 1}, {2, 1}, {1, 2}}) {
    const float weight = x.weight[i] * y.weight[j];
    if (weight == 0.0f) continue;
    sum += bilinear_tap(image, x.place[i], y.place[j]) * weight;
    weights += weight;
  }
  sum = sum / weights;
  for (int c = 0; c < 4; ++c) sum[c] = valid_light(sum[c]);
  return sum;
}

Vec4 taa_pixel(const TaaImages& images, const TaaSettings& settings, int x, int y) {
  const Vec4 now = clean_color(images.color, x, y);
  const Vec2 velocity = nearest_velocity(images, x, y),
             place(static_cast<float>(x) + 0.5f - velocity.x, static_cast<float>(y) + 0.5f - velocity.y);
  const bool inside = place.x >= 0.0f && place.x <= static_cast<float>(images.history.width) && place.y >= 0.0f &&
                      place.y <= static_cast<float>(images.history.height);
  if (!inside) return now;  // also where it is NaN
  const Vec4 before = taa_lookup(images.history, place);
  Vec3 history = to_ycocg(Vec3(before));
  float coverage = before.w;
  if (settings.clips) {
    Vec3 low = to_ycocg(Vec3(now)), high = low;
    float least = now.w, most = now.w;
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const Vec4 neighbour = clean_color(images.color, x + i, y + j);
        const Vec3 color = to_ycocg(Vec3(neighbour));
        low = glm::min(low, color), high = glm::max(high, color);
        least = std::min(least, neighbour.w), most = std::max(most, neighbour.w);
      }
    history = clip_to_box(history, low, high);
    coverage = std::clamp(coverage, least, most);
  }
  const float new_weight = settings.share / (1.0f + to_ycocg(Vec3(now)).x),
              old_weight = (1.0f - settings.share) / (1.0f + history.x), share = new_weight / (new_weight + old_weight);
  const Vec3 old_color = from_ycocg(history);
  Vec4 mixed = now * share + Vec4(old_color, coverage) * (1.0f - share);
  for (int c = 0; c < 4; ++c) mixed[c] = valid_light(mixed[c]);
  return mixed;
}

}  // namespace tessera::shaders
